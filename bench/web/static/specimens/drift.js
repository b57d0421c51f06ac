// Drift of a quantity over runs: a line with the 95 % interval of its slope, and runs that lie far from it.

const Z95 = 1.959964;
/** Degrees of freedom of a deviation that is known; Student's distribution is then normal to three digits. */
const KNOWN = 1000;
const LEAST_POINTS = 3;
const LEAST_FOR_OUTLIERS = 5;
/** Probability that a specimen without outliers shows one. */
const FALSE_ALARM = 0.05;

/**
 * Probability that Student's t lies within ± a value, for whole degrees of freedom.
 *
 * Abramowitz and Stegun, 26.7.3 and 26.7.4: finite sums, exact.
 */
export function shareWithin(t, freedom) {
  const angle = Math.atan(t / Math.sqrt(freedom));
  const [sine, cosine, first] = [Math.sin(angle), Math.cos(angle), freedom % 2];
  let sum = 0;
  for (let power = first, term = cosine ** first; power <= freedom - 2; power += 2) {
    sum += term;
    term *= ((power + 1) / (power + 2)) * cosine ** 2;
  }
  return first ? (2 / Math.PI) * (angle + sine * sum) : sine * sum;
}

/** Value below which |t| lies with a probability. */
function quantile(probability, freedom) {
  let [low, high] = [0, 1e5];
  while (high - low > 1e-9 * high) {
    const middle = (low + high) / 2;
    if (shareWithin(middle, freedom) < probability) low = middle;
    else high = middle;
  }
  return high;
}

/** Standard deviation behind a 95 % interval; null where the run does not determine the value. */
const deviationOf = ({ ci95 }) => (ci95 && ci95[1] > ci95[0] ? (ci95[1] - ci95[0]) / (2 * Z95) : null);

/**
 * Fits a line, constant up to `start` and linear after it, to points `{ x, value, ci95 }`.
 *
 * Points without an interval do not count. If the values scatter more than their intervals say, the deviation of the
 * slope is that of the scatter. Returns null for fewer than three points, or if all are before the change.
 */
export function fitLine(points, start = -Infinity) {
  const rows = points.map((point) => ({ ...point, deviation: deviationOf(point) })).filter(({ deviation }) => deviation);
  const from = Math.max(start, Math.min(...rows.map(({ x }) => x)));
  const along = (x) => Math.max(x - from, 0);
  const sum = (term) => rows.reduce((total, row) => total + term(row) / row.deviation ** 2, 0);
  const [ones, first, second] = [sum(() => 1), sum(({ x }) => along(x)), sum(({ x }) => along(x) ** 2)];
  const determinant = ones * second - first ** 2;
  if (rows.length < LEAST_POINTS || !(determinant > 1e-12 * ones * second)) return null;
  const [height, moment] = [sum(({ value }) => value), sum(({ x, value }) => along(x) * value)];
  const slope = (ones * moment - first * height) / determinant;
  const level = (height - slope * first) / ones;
  const at = (x) => level + slope * along(x);
  const freedom = rows.length - 2;
  const scatter = sum(({ x, value }) => (value - at(x)) ** 2) / freedom;
  const widening = Math.max(scatter, 1);
  const width = quantile(0.95, scatter > 1 ? freedom : KNOWN) * Math.sqrt((ones / determinant) * widening);
  /** Variance of the line at a place. */
  const variance = (x) => (widening * (second - 2 * first * along(x) + ones * along(x) ** 2)) / determinant;
  return { slope, ci95: [slope - width, slope + width], at, from, points: rows.length, variance, freedom, widening };
}

/**
 * Returns the indices of points that lie too far from the line through all others.
 *
 * The test allows for the number of points: a series without outliers shows one with a probability of at most 5 %.
 * Student's distribution is used, because values often scatter more than their intervals say.
 */
export function findOutliers(points, start) {
  const determined = points.filter(deviationOf).length;
  if (determined < LEAST_FOR_OUTLIERS) return [];
  return [...points.keys()].filter((k) => {
    const deviation = deviationOf(points[k]);
    const others = deviation && fitLine(points.filter((one, other) => other !== k), start);
    if (!others) return false;
    const { x, value } = points[k];
    const expected = Math.sqrt(deviation ** 2 * others.widening + others.variance(x));
    return 1 - shareWithin(Math.abs(value - others.at(x)) / expected, others.freedom) < FALSE_ALARM / determined;
  });
}
