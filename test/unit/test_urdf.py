"""The drone's URDF as one rigid body, compared with V-REP's numbers."""

import numpy as np
import pybullet
import pytest

from drone_sim.files.resources import package_path
from drone_sim.mechanics import frames, urdf

DRONE = package_path() / "urdf" / "drone.urdf"


def test_composite_is_derived_from_the_cuboid_and_the_four_cylinders():
    body = urdf.read(str(DRONE))
    height, radius, arm, up = 0.024, 0.15923 / 2, 0.09192, 0.002
    assert body.mass == pytest.approx(0.52)
    centre = 4 * 0.1 * up / 0.52
    assert body.centre_of_mass == pytest.approx([0, 0, centre])
    stick = 0.12 / 12 * np.array([2 * 0.02**2, 0.3**2 + 0.02**2, 0.3**2 + 0.02**2])
    disc = 0.1 * np.array([(3 * radius**2 + height**2) / 12] * 2 + [radius**2 / 2])
    moved_stick = 0.12 * centre**2 * np.array([1, 1, 0])
    moved_disc = 0.1 * (np.array([arm**2, arm**2, 2 * arm**2]) + (up - centre) ** 2 * np.array([1, 1, 0]))
    expected = stick + moved_stick + 4 * (disc + moved_disc)
    assert body.inertia == pytest.approx(np.diag(expected), rel=1e-6, abs=1e-12)
    assert np.diag(body.inertia) == pytest.approx([4.04e-3, 4.94e-3, 8.93e-3], rel=2e-3)


def test_inertia_rotates_with_its_link(tmp_path):
    path = tmp_path / "turned.urdf"
    path.write_text(
        """<robot name="r"><link name="a"><inertial><mass value="1"/>
        <inertia ixx="1" iyy="1" izz="1"/></inertial></link>
        <link name="b"><inertial><mass value="2"/><inertia ixx="1" iyy="2" izz="3"/></inertial></link>
        <joint name="j" type="fixed"><parent link="a"/><child link="b"/>
        <origin xyz="0 0 3" rpy="1.5707963267948966 0 0"/></joint></robot>"""
    )
    body = urdf.read(str(path))
    assert body.centre_of_mass == pytest.approx([0, 0, 2])
    # Rotated about x by 90 degrees, b's y and z moments are swapped; d = 2 and 1 along z.
    assert body.inertia == pytest.approx(np.diag([1 + 1 + 4 + 2, 1 + 3 + 4 + 2, 1 + 2]), abs=1e-9)


def test_front_camera_looks_forward_upright():
    optical = urdf.read(str(DRONE)).links["front_optical"]
    assert frames.rotate(optical, (0, 0, 1)) == pytest.approx((1, 0, 0))
    assert frames.rotate(optical, (0, -1, 0)) == pytest.approx((0, 0, 1))


@pytest.mark.parametrize(
    "old, new, message",
    [
        ('<mass value="0.12"/>', '<mass value="-0.12"/>', "link base_link: mass -0.12 kg: must not be negative"),
        ('<mass value="0.12"/>', '<mass value="nan"/>', "'nan': must be 1 finite numbers"),
        ("</robot>", "", "no element found"),
        ('type="continuous"', 'type="prismatic"', "type prismatic: must be fixed or continuous"),
    ],
)
def test_invalid_urdf_is_reported_in_one_line(tmp_path, old, new, message):
    path = tmp_path / "wrong.urdf"
    path.write_text(DRONE.read_text().replace(old, new))
    with pytest.raises(urdf.UrdfError) as caught:
        urdf.read(str(path))
    assert message in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_pybullet_can_load_the_urdf_directly():
    client = pybullet.connect(pybullet.DIRECT)
    drone = pybullet.loadURDF(str(DRONE), physicsClientId=client)
    links = range(-1, pybullet.getNumJoints(drone, client))
    masses = [pybullet.getDynamicsInfo(drone, link, client)[0] for link in links]
    assert sum(masses) == pytest.approx(0.52)
    pybullet.disconnect(client)
