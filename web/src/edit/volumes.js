// Volumes (m³) of shapes, from their size in a scene file; 0 if it is not known.
const VOLUMES = {
  box: ([x, y, z]) => x * y * z,
  sphere: ([radius]) => (4 / 3) * Math.PI * radius ** 3,
  cylinder: ([radius, length]) => Math.PI * radius ** 2 * length,
  cone: ([radius, length]) => (Math.PI * radius ** 2 * length) / 3,
  capsule: ([radius, length]) => Math.PI * radius ** 2 * (length + (4 / 3) * radius),
};

export const volumeOf = ({ type, size }) => (size && VOLUMES[type]?.(size)) || 0;
