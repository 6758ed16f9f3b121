"""A flight back from its table, drawn as when it was flown; what is no table gets one line."""

import pytest
from matplotlib.figure import Figure

from drone_sim.offline import recording
from drone_sim.offline.fly import main
from drone_sim.offline.recording import COLUMNS
from drone_sim.ros.tools import plot_flight

HEADER = ",".join(COLUMNS) + "\n"
ROW = "0,0,0,0.8,0,0,0,1" + ",0" * 14 + "\n"


def test_a_table_is_drawn_as_the_flight_was(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Figure, "savefig", lambda figure, *_, **__: drawn.append(figure))
    (tmp_path / "up.yaml").write_text("[{at: 0.1, twist: {linear: [1, 0, 0.5]}}]")
    assert main(["--commands", "up.yaml", "--duration", "1", "--csv", "flight.csv", "--plot", "flown.png"]) == 0
    assert plot_flight.main(["flight.csv"]) == 0
    lines = [[line.get_xydata().tolist() for ax in figure.axes for line in ax.get_lines()] for figure in drawn]
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
def test_what_is_no_table_gets_one_line(tmp_path, capsys, content, said):
    path = tmp_path / "flight.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    assert plot_flight.main([str(path), str(tmp_path / "out.png")]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"plot_flight: {path}: {said}")
    assert [one.name for one in tmp_path.iterdir()] == ["flight.csv"]


def test_a_table_has_its_limit(tmp_path, monkeypatch):
    monkeypatch.setattr(recording, "MAX_ROWS", 2)
    path = tmp_path / "flight.csv"
    path.write_text(HEADER + "".join(f"{time}{ROW[1:]}" for time in range(3)))
    with pytest.raises(recording.TableRefused, match=r"flight\.csv: has more than 2 rows"):
        recording.read_table(path)
