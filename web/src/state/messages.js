// The kinds of messages in the line below the script, each with the events that remove it, so that none stays after it has
// become wrong. Errors and pauses of a script are facts of the store and need no message here.
const LEFT = ["opened", "run"]; // the user opens another file, or runs a script

export const MESSAGES = {
  starting: { ends: ["opened", "answered", "failure", "unanswered"] }, // Run was pressed, and the simulator has not answered
  started: { ends: [...LEFT, "failure", "stopped", "unanswered"] }, // the script runs
  refused: { bad: true, ends: [...LEFT, "edited", "started", "unanswered"] }, // the simulator did not start the script
  trouble: { bad: true, ends: [...LEFT, "edited", "saved", "connected"] }, // an action failed
  restored: { ends: [...LEFT, "edited", "saved"] }, // a draft is in the editor again
  replaced: { ends: [...LEFT, "edited"] }, // another program's text came into the editor
  kept: { ends: [...LEFT, "edited"] }, // says after a conflict where the other text is
  inserted: { ends: [...LEFT, "edited"] }, // lines of the lesson were put into the script
  elsewhere: { ends: ["opened", "edited", "flown"] }, // the script that flies is in another folder, and cannot be edited
};
