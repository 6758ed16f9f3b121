// Frames that the user can choose for the axes of the handles, and for the numbers of a pose.
export const FRAMES_OF_HANDLES = { world: "World", parent: "Parent", own: "Own" };
export const FRAMES_OF_NUMBERS = { world: "World", parent: "Parent" };
