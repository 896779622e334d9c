// The dialog for the name, colour and merging of one label. They stay at the surface.

import { lockInRecord } from "../command.js";
import { $, h } from "../dom.js";
import { colourOf, hasName, isMerged, merge, nameOf, recolour, rename, shownLabels, split } from "../book.js";
import { tableColour } from "../palette.js";
import { store } from "../store.js";

export function editLabel(label) {
  const dialog = $("dialog");
  const name = h("input", { type: "text", maxLength: 60, value: hasName(label.id) ? nameOf(label.id) : "", placeholder: `Label ${label.id}` });
  const colour = h("input", { type: "color", value: colourOf(label.id) });
  const others = shownLabels(store.vehicle).filter((l) => l.id !== label.id);
  const into = h("select", {}, h("option", { value: "" }, "not merged"),
    ...others.map((l) => h("option", { value: l.id }, nameOf(l.id))));
  const save = (event) => {
    event.preventDefault();
    rename(label.id, name.value);
    recolour(label.id, colour.value);
    if (into.value) merge(label.id, Number(into.value));
    dialog.close();
  };
  const merged = label.members.filter((m) => m !== label.id);
  const divide = h("button", { type: "button", onclick: () => (split(label.id), dialog.close()) }, "Split again");
  dialog.replaceChildren(
    h("form", { onsubmit: save },
      h("h2", { id: "dialog-title" }, `Label ${label.id}`),
      h("label.field", {}, "Name", name),
      h("label.field", {}, "Colour", colour),
      h("button.link", { type: "button", onclick: () => (colour.value = tableColour(label.id)) }, "Use the standard colour"),
      h("label.field", {}, "Show as part of", into),
      merged.length > 0 ? h("p", {}, `Stands for ${merged.map((m) => `label ${m}`).join(", ")}. `, merged.some(isMerged) ? divide : null) : null,
      h("p.hint", {}, "These choices stay at the surface. The vehicle continues to use label numbers; exported files have both. A merged label is sent with the weight of the label that it is part of."),
      h("div.buttons", {},
        h("button", { type: "button", onclick: () => dialog.close() }, "Cancel"),
        h("button.primary", { type: "submit" }, "Save"))),
  );
  lockInRecord(dialog, ".buttons > [type=button]");
  dialog.showModal();
  name.focus();
}
