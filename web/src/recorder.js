// A button that records a stream, and saves the video when it is pressed again.
import { save, stamp } from "./dom.js";

const KIND = "video/webm";

export class Recorder {
  // `stream()` returns the MediaStream when a recording begins; `ended()` is called when it ends.
  constructor(button, stream, name, notice, ended = () => {}) {
    this.button = button;
    this.stream = stream;
    this.name = name;
    this.notice = notice;
    this.ended = ended;
    this.recorder = null;
    button.setAttribute("aria-pressed", "false");
    button.onclick = () => (this.recorder ? this.stop() : this.begin());
  }

  stop() {
    this.recorder?.stop();
  }

  begin() {
    if (!window.MediaRecorder?.isTypeSupported(KIND)) return this.notice.say("this browser cannot record videos", true);
    const parts = [];
    const recorder = new MediaRecorder(this.stream(), { mimeType: KIND });
    this.recorder = recorder;
    this.recorder.ondataavailable = ({ data }) => parts.push(data);
    this.recorder.onstop = () => {
      for (const track of recorder.stream.getTracks()) track.stop();
      this.recorder = null;
      this.button.setAttribute("aria-pressed", "false");
      this.ended();
      save(new Blob(parts, { type: KIND }), `drone_sim-${this.name}-${stamp()}.webm`);
      this.notice.say("the video is in your browser's downloads");
    };
    this.recorder.start(1000); // ms of video in each part
    this.button.setAttribute("aria-pressed", "true");
    this.notice.say("recording: press again to stop and save the video");
  }
}
