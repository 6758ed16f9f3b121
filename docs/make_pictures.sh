#!/usr/bin/env bash
# Makes every picture of README.md and docs/: docs/make_pictures.sh [SECTION...]   (default: all sections)
#
# Needs what ./dev.sh setup --all installs; section windows also packages that it names.
# A section is a function below, named in `sections`.
set -eo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PYTHONPATH=$PWD/src:$PYTHONPATH
python=.venv/bin/python
pictures=docs/pictures
sections=(diagrams cameras plots remote weather report tasks cockpit cockpit-film windows)

# The diagrams of docs/tutorial.md.
diagrams() { "$python" docs/draw_diagrams.py "$pictures"; }

# What the drone's own cameras see.
cameras() { "$python" docs/take_pictures.py "$pictures"; }

# The flights of docs/tutorial.md, as its commands fly them.
plots() {
  plot 1_thrust --duration 12
  local stage
  for stage in 2_elevation 3_yaw 4_pitch 5_roll 6_ros; do plot "$stage"; done
  "$python" scripts/fly --script docs/tutorial/5_roll.py --commands docs/tutorial/stability.yaml \
    --set "drone.position=[0, 0, 5]" --plot "$pictures/tutorial_stability.png"
}

# The flight of docs/remote_api.md; needs the client that ./dev.sh test installs.
remote() { "$python" docs/remote/without_ros.py --plot "$pictures/remote_circle.png"; }

# The flights of docs/weather.md, beside their theory, and one as a film; prints the numbers that the page quotes.
weather() {
  "$python" docs/draw_weather.py "$pictures"
  "$python" docs/film_weather.py "$pictures"
}

# The report of docs/grading.md; needs what ./dev.sh test-web installs.
report() {
  local folder
  folder=$(mktemp -d)
  "$python" scripts/grade docs/grading/gates.yaml pilot --html "$folder" || true # two of its flights fail
  "$python" docs/take_report_picture.py "$folder" "$pictures/report.png"
  rm -r "$folder"
}

# The textures of tasks/, and a picture of each task in its folder.
tasks() { "$python" docs/make_textures.py && "$python" docs/take_task_pictures.py; }

# The cockpit of docs/cockpit.md and README.md; needs what ./dev.sh test-web installs.
cockpit() { "$python" docs/take_cockpit_pictures.py "$pictures"; }

# The same in motion, for README.md; three minutes, on a machine that does nothing else.
cockpit-film() { "$python" docs/film_cockpit.py "$pictures/cockpit.webp"; }

# rviz, as drone.launch shows it, and with the target sphere dragged; image_view.
windows() { docs/take_window_pictures.sh "$pictures"; }

plot() { # plot STAGE [OPTION...]
  "$python" scripts/fly --script "docs/tutorial/$1.py" --commands "docs/tutorial/$1.yaml" \
    --plot "$pictures/tutorial_$1.png" "${@:2}"
}

mkdir -p "$pictures"
for section in "${@:-${sections[@]}}"; do
  declare -F "$section" >/dev/null || { echo "make_pictures.sh: no section $section; there are: ${sections[*]}" >&2; exit 1; }
  "$section"
done
