// What the plots of a comparison show: overlay of one stroke, peak force against velocity, energy per cycle.

import { significant } from "../common/format.js";
import { QUANTITIES } from "../common/quantities.js";

const DEGREES = 360;
const DRIVE_STEP = 0.01; // strokes whose drives differ by less are joined [V or A]
const COUNTS = [1, 2, 5, 10, 20, 50];

const named = ({ label, unit }) => `${label} [${unit}]`;
const lower = (text) => text.replace(/^./, (first) => first.toLowerCase());
const scaled = (values, { scale }) => values.map((value) => value * scale);

/** Drive of a stroke with its unit; measured drives are rounded to a thousandth. */
export const describeDrive = (drive, unit) => `${significant(Math.round(drive * 1e3) / 1e3 + 0, 3)} ${unit}`;

/** Contents of three plots: force of all runs against displacement, velocity and phase. */
export function makeOverlay({ runs, reference }, stroke) {
  const { force, displacement, velocity } = QUANTITIES;
  const phase = { label: "Phase", unit: "°", scale: DEGREES };
  const degrees = { range: [0, DEGREES], axis: { incrs: [30, 45, 90] } };
  return [
    { across: displacement, key: "displacement_m", closed: true },
    { across: velocity, key: "velocity_mps", closed: true },
    { across: phase, key: "phase", closed: false, x: degrees },
  ].map(({ across, key, closed, x }) => ({
    caption: `${named(force)} against ${lower(named(across))}`,
    x,
    lines: stroke.strokes.map((one) => ({
      place: findPlace(runs, one.run), x: scaled(one.curve[key], across), y: scaled(one.curve.force_n, force), closed,
    })),
    band: makeBand(runs, stroke, reference, { key, across, closed }),
  }));
}

function makeBand(runs, stroke, reference, { key, across, closed }) {
  const one = stroke.strokes.find(({ run }) => run === reference);
  if (!stroke.band || !one) return null;
  const [low, high] = [stroke.band.lower_n, stroke.band.upper_n].map((values) => scaled(values, QUANTITIES.force));
  return { place: findPlace(runs, reference), x: scaled(one.curve[key], across), lower: low, upper: high, closed };
}

/** Content of the plot of peak force against largest speed: a line for each run, drive and direction. */
export function makePeaks({ runs, strokes, drive_unit: unit }) {
  const { force, velocity } = QUANTITIES;
  const drives = Map.groupBy(strokes, ({ drive }) => Math.round(drive / DRIVE_STEP));
  const lines = [...drives.values()].flatMap((group) => runs.flatMap((run, place) => {
    const found = group.flatMap((stroke) => stroke.strokes.filter((one) => one.run === run.run));
    found.sort((a, b) => a.peak_velocity_mps - b.peak_velocity_mps);
    const x = found.map((one) => one.peak_velocity_mps * velocity.scale);
    return ["peak_tension_n", "peak_compression_n"].map((key) => ({
      place, x, y: found.map((one) => one[key] * force.scale), marked: true, drive: group[0].drive,
    }));
  })).filter(({ x }) => x.length);
  const labels = lines.filter(({ place, y }) => place === 0 && y.at(-1) > 0)
    .map(({ x, y, drive }) => ({ x: x.at(-1), y: y.at(-1), text: describeDrive(drive, unit) }));
  return { caption: `Peak ${lower(named(force))} against largest speed [${velocity.unit}]`, lines, labels };
}

/** Content of the plot of energies: one place on the axis for each stroke, the runs beside each other. */
export function makeEnergies({ runs, strokes }) {
  const step = 0.6 / runs.length;
  const lines = runs.map((run, place) => {
    const found = strokes.flatMap((stroke, k) => stroke.strokes.filter((one) => one.run === run.run).map((one) => ({ one, k })));
    return {
      place, marked: true, unjoined: true,
      x: found.map(({ k }) => k + 1 + (place - (runs.length - 1) / 2) * step),
      y: found.map(({ one }) => one.energy_j),
      spread: found.map(({ one }) => one.energy_sd_j),
    };
  });
  const x = { range: [0.5, strokes.length + 0.5], axis: { incrs: COUNTS } };
  return { caption: "Energy per cycle [J] by number of the stroke; bars: ± standard deviation", lines, x };
}

const findPlace = (runs, id) => runs.findIndex(({ run }) => run === id);
