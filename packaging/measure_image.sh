#!/usr/bin/env bash
# packaging/measure_image.sh [IMAGE [OPTION...]]: prints how large an image is, and how long it takes from its start to the
# cockpit's page, 3D scene and camera picture, without a network. OPTIONs are for `docker run`; with podman: DOCKER=podman.
set -eo pipefail
docker=${DOCKER:-docker}
image=${1:-drone_sim}
here=$(dirname "${BASH_SOURCE[0]}")

bytes=$($docker save "$image" | gzip -c | wc -c)
echo "compressed, as registries count: $((bytes / 1000000)) MB"

start=$(date +%s.%N)
container=$($docker run -d --network none "${@:2}" "$image")
trap '$docker rm -f "$container" >/dev/null' EXIT
$docker exec -i "$container" /usr/lib/drone_sim/python/bin/python - "$start" <"$here/first_picture.py"
if $docker logs "$container" 2>&1 | grep "/?token=" >/dev/null; then echo "its log has the address with the token"; fi
