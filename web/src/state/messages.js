// The messages in the line below the script. Each has the events that end it; a message without an end would be
// believed after it has become wrong. Errors of a script, and pauses, are facts of the store and have no message here.
const LEFT = ["opened", "run"]; // the user goes on to another file, or flies

export const MESSAGES = {
  starting: { ends: ["opened", "answered", "failure", "lost"] }, // Run was pressed, and the simulator has not answered
  started: { ends: ["run", "failure", "stopped", "lost"] }, // the flight goes on
  refused: { bad: true, ends: [...LEFT, "edited", "started"] }, // the simulator did not start it
  trouble: { bad: true, ends: [...LEFT, "edited", "saved", "connected"] }, // an action failed; the next one counts
  restored: { ends: [...LEFT, "edited", "saved"] }, // a draft is in the editor again
  replaced: { ends: [...LEFT, "edited"] }, // another program's text came into the editor
  kept: { ends: [...LEFT, "edited"] }, // after a conflict: where the other text is
  inserted: { ends: [...LEFT, "edited"] }, // lines of the lesson were put into the script
  elsewhere: { ends: ["opened", "edited", "flown"] }, // a script flies that cannot be edited here
};
