// Starts the page. Every part listens to the store, and the feed fills it.

import { startCloud } from "./cloud/cloud.js";
import { startPrincipal } from "./command.js";
import { startFeed } from "./feed.js";
import { startChart } from "./map/chart.js";
import { startBanners } from "./panel/banners.js";
import { startBar } from "./panel/bar.js";
import { startCommand } from "./panel/command.js";
import { startConstraints } from "./panel/constraints.js";
import { startKeys } from "./panel/keys.js";
import { startLabels } from "./panel/labels.js";
import { startLink } from "./panel/link.js";
import { startModel } from "./panel/model.js";
import { startTabs } from "./panel/tabs.js";
import { startTools } from "./panel/tools.js";
import { startVehicle } from "./panel/vehicle.js";
import { store } from "./store.js";
import { onTheme, startTheme } from "./theme.js";

startTheme();
startPrincipal();
startBar();
startCommand();
startBanners();
startTabs();
startConstraints();
startModel();
startLabels();
startVehicle();
startLink();
startChart();
startCloud();
startTools();
startKeys();
onTheme(() => store.emit("theme"));
startFeed();
setInterval(() => store.emit("tick"), 1000);
