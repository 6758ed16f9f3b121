"""Flight tables: plotted as during the flight; an invalid table is reported in one line."""

import pytest
from matplotlib.figure import Figure

from drone_sim.offline import recording
from drone_sim.offline.fly import main
from drone_sim.offline.recording import COLUMNS
from drone_sim.ros.tools import plot_flight

HEADER = ",".join(COLUMNS) + "\n"
ROW = "0,0,0,0.8,0,0,0,1" + ",0" * 14 + "\n"


def test_plot_of_a_table_equals_the_plot_of_the_flight(tmp_path, monkeypatch):
    figures = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Figure, "savefig", lambda figure, *_, **__: figures.append(figure))
    (tmp_path / "up.yaml").write_text("[{at: 0.1, twist: {linear: [1, 0, 0.5]}}]")
    assert main(["--commands", "up.yaml", "--duration", "1", "--csv", "flight.csv", "--plot", "flown.png"]) == 0
    assert plot_flight.main(["flight.csv"]) == 0
    lines = [[line.get_xydata().tolist() for ax in figure.axes for line in ax.get_lines()] for figure in figures]
    assert lines[0] == lines[1]
    assert (tmp_path / "flight.png").exists()
    assert recording.read_table("flight.csv").rows[-1][0] == 1.0


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "is empty"),
        (b"a,b\n1,2\n", "line 1 is 'a,b': a table of `fly --csv` begins with t [s],x [m],..."),
        (HEADER, "has a header but no rows"),
        (HEADER[:50], "line 1 is "),
        (HEADER + ROW + ROW[:20], "line 3: has"),
        (HEADER + ROW[:-1], "line 2: has"),
        (HEADER + ROW.replace("0.8", "high"), "line 2: could not convert string to float: 'high'"),
        (HEADER + ROW.replace("0.8", "nan"), "line 2: must hold numbers below 1e+09"),
        (HEADER + ROW.replace("0.8", "-1e300"), "line 2: must hold numbers below 1e+09"),
        (HEADER + ROW + ROW, "line 3: the time 0 s is not after 0 s"),
        (HEADER + "1" * 100_000, "line 2: has"),
        (b"\x89PNG\r\n\xff\xfe\n", "is not a text file"),
    ],
)
def test_invalid_table_is_reported_in_one_line(tmp_path, capsys, content, said):
    path = tmp_path / "flight.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    assert plot_flight.main([str(path), str(tmp_path / "out.png")]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"plot_flight: {path}: {said}")
    assert [file.name for file in tmp_path.iterdir()] == ["flight.csv"]


def test_number_of_rows_in_a_table_is_limited(tmp_path, monkeypatch):
    monkeypatch.setattr(recording, "MAX_ROWS", 2)
    path = tmp_path / "flight.csv"
    path.write_text(HEADER + "".join(f"{time}{ROW[1:]}" for time in range(3)))
    with pytest.raises(recording.TableRefused, match=r"flight\.csv: has more than 2 rows"):
        recording.read_table(path)
