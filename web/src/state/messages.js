// The messages in the line below the script, each with the events that end it, so that none stays after it has become
// wrong. Errors of a script, and pauses, are facts of the store and have no message here.
const LEFT = ["opened", "run"]; // the user opens another file, or flies

export const MESSAGES = {
  starting: { ends: ["opened", "answered", "failure", "unanswered"] }, // Run was pressed, and the simulator has not answered
  started: { ends: [...LEFT, "failure", "stopped", "unanswered"] }, // the flight goes on
  refused: { bad: true, ends: [...LEFT, "edited", "started", "unanswered"] }, // the simulator did not start the script
  trouble: { bad: true, ends: [...LEFT, "edited", "saved", "connected"] }, // an action failed; the next one counts
  restored: { ends: [...LEFT, "edited", "saved"] }, // a draft is in the editor again
  replaced: { ends: [...LEFT, "edited"] }, // another program's text came into the editor
  kept: { ends: [...LEFT, "edited"] }, // after a conflict: where the other text is
  inserted: { ends: [...LEFT, "edited"] }, // lines of the lesson were put into the script
  elsewhere: { ends: ["opened", "edited", "flown"] }, // the script that flies cannot be edited here
};
