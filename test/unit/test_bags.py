"""Flights read from bags: states, sensors, plots and videos, and one line for each file that is not a valid bag."""

import io
import zlib

import cv2
import numpy as np
import pytest

pytest.importorskip("rosbag", reason="needs ROS")

import genpy
import rosbag
import rospy
from geometry_msgs.msg import PoseStamped, WrenchStamped
from matplotlib.figure import Figure
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CompressedImage, Imu, Range
from std_msgs.msg import String

from drone_sim.forces.pushes import Push
from drone_sim.mechanics.state import Pose, Twist, Vector3
from drone_sim.offline.recording import Recording
from drone_sim.ros.core import message_conversion as messages
from drone_sim.ros.core.image_messages import image
from drone_sim.ros.tools import bag_commands, bag_video, bags, plot_flight, record
from drone_sim.ros.tools.bags import Bag, BagError, BagFlight
from drone_sim.ros.tools.record import topics_to_record
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

BEGAN = 1000.0  # s, of the recorder's clock
STEPS = 40
RED = np.full((240, 320, 3), (0, 0, 200), np.uint8)


@pytest.fixture(name="flown", scope="module")
def _flown(tmp_path_factory):
    """A bag as `drone.launch record:=true` writes it, and the recording of the same flight."""
    path = tmp_path_factory.mktemp("bags") / "flight.bag"
    simulation, recording = Simulation(parameters.load()), Recording()
    jpeg = CompressedImage(format="jpeg", data=cv2.imencode(".jpg", RED)[1].tobytes())
    with rosbag.Bag(str(path), "w") as bag:

        def write(topic, message, late=0.002):
            at = rospy.Time.from_sec(BEGAN + simulation.time)
            if hasattr(message, "header"):
                message.header.stamp = at
            bag.write(topic, message, at + rospy.Duration.from_sec(late))

        write("/drone_sim/state", String("flying"))
        for step in range(STEPS):
            if step == 10:
                simulation.drone.commands.receive(Twist(Vector3(1, 0, 0.2), Vector3(0, 0, 0.5)))
            simulation.step()
            drone, stamp = simulation.drone, rospy.Time()
            recording.add(simulation)
            write("/drone/odom", messages.odometry(stamp, drone.body.state, "base_link"), 0.001)
            write("/drone/propellers", messages.propellers(drone.propulsion.particle_velocities))
            write("/drone/command", messages.command(stamp, drone.commands.now, "Track_base"))
            write("/drone/range", Range(range=step))
            write("/drone/imu/data", Imu())
            write("/drone/imu/data_raw", Imu())
            write("/drone/front/compressed", jpeg, 0.01)
        write("/drone/push", WrenchStamped(), 0)
        write("/drone/set_pose", PoseStamped(), 0)
    simulation.close()
    return str(path), recording


@pytest.fixture(name="bag")
def _bag(flown):
    bag = Bag(flown[0])
    yield bag
    bag.close()


@pytest.fixture(name="drawn")
def _drawn(monkeypatch):
    drawn = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, *_, **__: drawn.append(figure))
    return drawn


def test_the_recorded_states_are_read_back(flown, bag):
    rows = np.array(BagFlight(bag).recording().rows)
    expected = np.array(flown[1].rows)
    expected[:, 0] -= expected[0, 0]
    assert rows.shape == expected.shape == (STEPS, 22)
    assert np.abs(rows[:, :18] - expected[:, :18]).max() < 1e-6  # stamps are in ns
    assert np.abs(rows[:, 18:] - expected[:, 18:]).max() < 1e-6  # propellers are 32 bit floats


def test_pushes_teleports_and_sensors_are_read_back(bag):
    flight = BagFlight(bag, "drone")
    assert [(type(one.action), one.at) for one in flight.timeline().entries] == [
        (Pose, pytest.approx(1.95)),
        (Push, pytest.approx(1.95)),
    ]
    series = flight.sensors()
    assert [(one.title, one.values.shape) for one in series] == [
        ("imu/data", (STEPS, 3)),
        ("imu/data", (STEPS, 3)),
        ("range", (STEPS, 1)),
    ]
    assert series[-1].values[:, 0].tolist() == list(range(STEPS))


def test_values_without_a_topic_are_nan_and_plotted_as_not_recorded(tmp_path, drawn):
    path = str(tmp_path / "odom.bag")
    with rosbag.Bag(path, "w") as bag:
        for second in (1, 2, 2, 3, 4):
            message = Odometry()
            message.header.stamp = rospy.Time(second)
            message.pose.pose.orientation.w = 1.0 if second != 3 else 0.0  # no quaternion
            message.pose.pose.position.x = second
            bag.write("/a/b/odom", message, rospy.Time(second))
    flight = BagFlight(Bag(path))
    rows = np.array(flight.recording().rows)
    assert flight.namespace == "/a/b"
    assert rows[:, :2].tolist() == [[0, 1], [1, 2], [3, 4]]
    assert not rows[:, 14:18].any()
    assert np.isnan(rows[:, 18:]).all()
    assert plot_flight.main([path, str(tmp_path / "odom.png")]) == 0
    assert [text.get_text() for ax in drawn[0].axes for text in ax.texts] == ["not recorded"]


def test_the_plot_of_a_bag_contains_its_sensors(flown, tmp_path, monkeypatch, drawn):
    monkeypatch.chdir(tmp_path)
    assert plot_flight.main([flown[0]]) == 0
    labels = {ax.get_ylabel(): ax for ax in drawn[0].axes}
    assert labels["range [m]"].get_lines()[0].get_ydata()[-1] == STEPS - 1
    assert labels["forward $v_x$ [m/s]"].get_lines()[0].get_ydata()[-1] == 1.0
    assert labels["range [m]"].get_xlabel() == "time by the stamps [s]"
    assert [path.name for path in tmp_path.iterdir()] == ["flight.png"]


def test_the_pictures_of_a_bag_become_a_video(flown, tmp_path, capsys):
    out = tmp_path / "out.mp4"
    assert bag_video.main([flown[0], str(out)]) == 0
    assert f"of /drone/front/compressed: 320 x 240, {STEPS} pictures, 2.00 s" in capsys.readouterr().out
    reader = cv2.VideoCapture(str(out))
    (_, first), count = reader.read(), 1
    while reader.read()[0]:
        count += 1
    assert count == STEPS
    assert abs(first[60:120].astype(int) - RED[0, 0]).max() < 12
    assert abs(first[:14].astype(int) - RED[0, 0]).mean() > 30  # the display


def test_a_video_repeats_the_last_picture_during_a_gap(tmp_path):
    path, out = str(tmp_path / "gap.bag"), tmp_path / "out.mp4"
    with rosbag.Bag(path, "w") as bag:
        for at in (1.0, 1.1, 1.2, 2.2, 2.3, 100.0):
            message = image(RED, "bgr8")
            message.header.stamp = rospy.Time.from_sec(at)
            bag.write("/camera/image", message, message.header.stamp)
    assert bag_video.main([path, str(out)]) == 0
    assert cv2.VideoCapture(str(out)).get(cv2.CAP_PROP_FRAME_COUNT) == 13 + 100 + 1  # gaps are filled for at most 10 s


def test_a_bag_with_invalid_pictures_only_is_reported(tmp_path, capsys):
    path, out = str(tmp_path / "wrong.bag"), tmp_path / "out.mp4"
    with rosbag.Bag(path, "w") as bag:
        bag.write("/camera/image/compressed", CompressedImage(format="jpeg", data=b"none"), rospy.Time(1))
    assert bag_video.main([path, str(out)]) == 1
    assert "/camera/image/compressed: not a picture: format 'jpeg'" in capsys.readouterr().err
    assert not out.exists()


def test_a_damaged_picture_is_skipped(tmp_path, capsys):
    path, out = str(tmp_path / "damaged.bag"), tmp_path / "out.mp4"
    with rosbag.Bag(path, "w") as bag:
        for at in range(5):
            data = b"none" if at == 2 else cv2.imencode(".jpg", RED)[1].tobytes()
            message = CompressedImage(format="jpeg", data=data)
            message.header.stamp = rospy.Time.from_sec(1 + at / 10)
            bag.write("/camera/image/compressed", message, message.header.stamp)
    assert bag_video.main([path, str(out)]) == 0
    assert "1 are left out: not a picture: format 'jpeg'" in capsys.readouterr().out
    assert cv2.VideoCapture(str(out)).get(cv2.CAP_PROP_FRAME_COUNT) == 5, "the picture before it is shown longer"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "is empty"),
        (b"#ROSBAG V2.0\n", "was cut off"),
        (b"#ROSBAG V9.0\n", "cannot be read as a bag"),
        (b"picture", "cannot be read as a bag"),
        (4096 + 2000, "was cut off"),
        (0.5, "was cut off"),
        (0.999, "was cut off"),
    ],
)
def test_a_truncated_or_invalid_bag_gets_one_line(flown, tmp_path, capsys, content, said):
    path = tmp_path / "wrong.bag"
    if not isinstance(content, bytes):
        with open(flown[0], "rb") as file:
            whole = file.read()
        content = whole[: content if isinstance(content, int) else int(content * len(whole))]
    path.write_bytes(content)
    for program, out in ((plot_flight, "out.png"), (bag_video, "out.mp4")):
        assert program.main([str(path), str(tmp_path / out)]) == 1
        (line,) = capsys.readouterr().err.splitlines()
        assert f"{path}: {said}" in line
    assert [one.name for one in tmp_path.iterdir()] == ["wrong.bag"]


@pytest.mark.parametrize(
    ("program", "arguments", "said"),
    [
        (plot_flight, ["BAG", "--vehicle", "drone2"], "no odometry /drone2/odom; near names are /drone/odom"),
        (plot_flight, ["BAG", "out.wrong"], "matplotlib does not write .wrong"),
        (plot_flight, ["nowhere.bag"], "nowhere.bag: No such file"),
        (plot_flight, ["flight.mp3"], "'flight.mp3': must end in .csv, .txt or .bag"),
        (plot_flight, ["flight.csv", "--vehicle", "drone"], "--vehicle 'drone': only works with a bag"),
        (bag_video, ["BAG", "out.avi"], "out.avi: must end in .mp4"),
        (bag_video, ["BAG", "out.mp4", "--topic", "/drone/front"], "near names are /drone/front/compressed"),
        (bag_video, [".", "out.mp4"], ".: is not a regular file"),
    ],
)
def test_a_wrong_argument_gives_one_line_and_status_1(flown, tmp_path, monkeypatch, capsys, program, arguments, said):
    monkeypatch.chdir(tmp_path)
    assert program.main([flown[0] if one == "BAG" else one for one in arguments]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line
    assert not list(tmp_path.iterdir())


def test_a_message_with_another_definition_is_not_read(tmp_path):
    path = str(tmp_path / "other.bag")
    other_class = genpy.dynamic.generate_dynamic("nav_msgs/Odometry", "string data\n")["nav_msgs/Odometry"]
    with rosbag.Bag(path, "w") as bag:
        bag.write("/drone/odom", other_class(data="x"), rospy.Time(1))
    with pytest.raises(BagError, match="no readable message on /drone/odom"):
        BagFlight(Bag(path))


def test_an_invalid_utf8_name_logs_no_warning(tmp_path, caplog, monkeypatch):
    monkeypatch.setattr(genpy.message, "_warned_decoding_error", set())
    path, odometry = str(tmp_path / "flight.bag"), io.BytesIO()
    Odometry(child_frame_id="base_link").serialize(odometry)
    content = odometry.getvalue().replace(b"base_link", b"\x9ease_link")
    with rosbag.Bag(path, "w") as bag:
        bag.write("/drone/odom", (Odometry._type, content, Odometry._md5sum, Odometry), rospy.Time(1), raw=True)
    (found,) = Bag(path).read("/drone/odom", "nav_msgs/Odometry")
    assert found.message.child_frame_id == "\ufffdase_link"
    assert not caplog.records


@pytest.mark.parametrize(("program", "out"), [(plot_flight, "o.png"), (bag_commands, "o.yaml"), (bag_video, "o.mp4")])
def test_topics_of_another_message_type_are_ignored(tmp_path, capsys, program, out):
    path = str(tmp_path / "other.bag")
    kinds = (
        "cmd_vel",
        "command",
        "propellers",
        "set_pose",
        "initialpose",
        "push",
        "goto",
        "takeoff",
        "weather",
        "state",
    )
    drone = Odometry()
    drone.pose.pose.orientation.w = 1.0
    with rosbag.Bag(path, "w") as bag:
        for second in (1, 2, 3):
            drone.header.stamp = rospy.Time(second)
            bag.write("/drone/odom", drone, rospy.Time(second))
            bag.write("/drone/front", image(RED, "bgr8"), rospy.Time(second))
            for name in kinds:
                bag.write(f"/drone/{name}", String("x") if name != "state" else Range(), rospy.Time(second))
        raw = ("os/path", b"", "0" * 32, None, String)
        bag.write("/drone/imu/data", raw, rospy.Time(4), raw=True)
    status = program.main([path, str(tmp_path / out)])
    said = capsys.readouterr().err
    refusal = "it has no commands on /drone/cmd_vel" if program is bag_commands else ""
    assert status == (1 if refusal else 0)
    assert said.partition(".bag: ")[2].startswith(refusal)


def test_an_oversized_chunk_or_picture_is_refused(flown, tmp_path, monkeypatch, capsys):
    path, out = str(tmp_path / "large.bag"), str(tmp_path / "out.mp4")
    monkeypatch.setattr(bags, "MAX_CHUNK", 1000)
    assert plot_flight.main([flown[0], str(tmp_path / "out.png")]) == 1
    assert "bytes; at most 1000 are" in capsys.readouterr().err
    monkeypatch.undo()
    size = np.array([5000, 5000], ">u4").tobytes()  # of a PNG, in its header
    header = b"IHDR" + size + b"\x08\x02\0\0\0"
    data = b"\x89PNG\r\n\x1a\n\0\0\0\x0d" + header + zlib.crc32(header).to_bytes(4, "big") + bytes(4) + b"IDAT"
    with rosbag.Bag(path, "w") as bag:
        bag.write("/camera/image/compressed", CompressedImage(format="png", data=data), rospy.Time(1))
    assert bag_video.main([path, out]) == 1
    assert "/camera/image/compressed: 5000 x 5000 px: at most 4096 x 4096 px are allowed" in capsys.readouterr().err


def test_pictures_are_recorded_on_request_and_only_compressed():
    kinds = {
        "/drone/odom": "nav_msgs/Odometry",
        "/drone/cmd_vel": "geometry_msgs/Twist",
        "/drone/front": "sensor_msgs/Image",
        "/drone/front/compressed": "sensor_msgs/CompressedImage",
        "/drone/camera_info": "sensor_msgs/CameraInfo",
        "/drone/front/compressed/parameter_updates": "dynamic_reconfigure/Config",
        "/drone/contacts": "visualization_msgs/MarkerArray",
        "/rosout": "rosgraph_msgs/Log",
        "/rosout_agg": "rosgraph_msgs/Log",
        "/clock": "rosgraph_msgs/Clock",
    }
    small = ["/drone/cmd_vel", "/drone/odom", "/rosout"]
    assert topics_to_record(kinds, images=False) == small
    assert topics_to_record(kinds, images=True) == sorted([*small, "/drone/camera_info", "/drone/front/compressed"])


def test_record_reports_that_it_waits_for_the_simulator(monkeypatch, capsys):
    class Master:
        call_count = 0

        def __init__(self, _name):
            pass

        def lookupService(self, _name):
            Master.call_count += 1
            if Master.call_count < 200:
                raise record.rosgraph.MasterError("not yet")

        def getTopicTypes(self):
            return []

    monkeypatch.setattr(record.rosgraph, "Master", Master)
    monkeypatch.setattr(record.time, "sleep", lambda _: None)
    monkeypatch.setattr(record.time, "monotonic", lambda: 0.1 * Master.call_count)
    assert record._wait_for_topics("/drone_sim") == {}
    assert capsys.readouterr().err.startswith("record: waiting for /drone_sim")
