// The true classes of the synthetic sea floor: sand in the west, seagrass in the east.

export const TRUTH = {
  west_m: -20, south_m: -15, east_m: 20, north_m: 15,
  classes: [{ value: 1, name: "sand", colour: "#e69f00" }, { value: 2, name: "seagrass", colour: "#56b4e9" }],
};

/** A PNG of two pixels. */
export const PICTURE = Buffer.from(
  "iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAMAAADD/I+4AAAACVBMVEUAAADmnwBWtOkhZsL8AAAAC0lEQVR4nGNgZAIAAAcABHZJ4ygAAAAASUVORK5CYII=",
  "base64",
);
