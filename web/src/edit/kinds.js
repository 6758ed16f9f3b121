// Icons of objects, by their `shape` or `kind` in a scene file.
const ICONS = {
  box: "cube", sphere: "ball", cylinder: "cylinder", capsule: "cylinder", cone: "cone", plane: "floor", compound: "group", mesh: "mesh", urdf: "mesh",
  vehicle: "drone", floor: "floor", dummy: "dummy", camera: "video", vehicle_camera: "video", vision_sensor: "video", proximity_sensor: "proximity",
  joint: "joint", force_sensor: "force", path: "path", curved_path: "path", script: "script",
};

export const iconOf = ({ type, model }) => (model && type === "dummy" ? "group" : ICONS[type] ?? (type.endsWith("_sensor") ? "proximity" : "part"));
