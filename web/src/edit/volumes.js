// Volumes (m³) of shapes, by what a scene file says of their size; 0 where that is not known.
const VOLUMES = {
  box: ([x, y, z]) => x * y * z,
  sphere: ([radius]) => (4 / 3) * Math.PI * radius ** 3,
  cylinder: ([radius, length]) => Math.PI * radius ** 2 * length,
  cone: ([radius, length]) => (Math.PI * radius ** 2 * length) / 3,
  capsule: ([radius, length]) => Math.PI * radius ** 2 * (length + (4 / 3) * radius),
};

export const volumeOf = ({ type, size }) => (size && VOLUMES[type]?.(size)) || 0;
