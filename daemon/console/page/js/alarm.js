// The alarm sound: three short tones for a new alarm, if the operator has switched it on in this browser.

import { $ } from "./dom.js";
import { recall, remember } from "./prefs.js";

/** Frequencies in Hz, and the seconds from one tone to the next. */
const TONES_HZ = [660, 880, 660];
const TONE_S = 0.18;

let isOn = false;
let audio = null;

export function startAlarm() {
  isOn = recall("sound", false);
  mark();
  $("sound").addEventListener("click", () => {
    isOn = !isOn;
    remember("sound", isOn);
    mark();
    // A browser plays no sound before a press; this one also shows what the alarm sounds like.
    soundAlarm();
  });
}

/** Sounds the alarm, if it is on. A browser that plays no sound stays silent. */
export function soundAlarm() {
  if (!isOn) return;
  try {
    audio ??= new AudioContext();
    audio.resume();
    TONES_HZ.forEach((hertz, i) => tone(hertz, audio.currentTime + i * TONE_S));
  } catch {
    // Without a sound device the banners and announcements remain.
  }
}

function tone(hertz, at) {
  const [source, gain] = [audio.createOscillator(), audio.createGain()];
  source.frequency.value = hertz;
  gain.gain.setValueAtTime(0.0001, at);
  gain.gain.exponentialRampToValueAtTime(0.2, at + 0.02);
  gain.gain.exponentialRampToValueAtTime(0.0001, at + TONE_S);
  source.connect(gain).connect(audio.destination);
  source.start(at);
  source.stop(at + TONE_S);
}

function mark() {
  const button = $("sound");
  button.setAttribute("aria-pressed", String(isOn));
  button.title = isOn ? "Each new alarm sounds" : "Alarms are silent";
}
