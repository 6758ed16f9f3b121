// Whose axes count: for the handles, and for the numbers.
export const FRAMES_OF_HANDLES = { world: "World", parent: "Parent", own: "Own" };
export const FRAMES_OF_NUMBERS = { world: "World", parent: "Parent" };
