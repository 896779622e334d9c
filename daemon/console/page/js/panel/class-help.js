// What the classes of data on the link are, for hovering.

import { plain } from "../format.js";

const HELP = {
  map: "Labels of the map",
  status: "Reports of the vehicle: its position, mode and plan",
  directive: "Orders to the vehicle, except position fixes",
  fix: "Position fixes for the vehicle",
  exemplar: "Images of labels",
  overhead: "Heads of frames, answers and checks",
};

/** A class that is none of these is a layer of the map. */
export const classHelp = (name) => HELP[name] ?? `Values of the map's layer ${plain(name)}`;
