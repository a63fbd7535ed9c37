// The histogram of the round trip: one message, published at the last tick. A viewer that loads a file piece by piece
// delivers some ticks twice; each tick counts once.

type Tick = { message: { seq: number; round_trip: number } };
type Histogram = { time: number[]; ticks: number[] };

export const inputs = [$input];
export const output = $output;

const LAST = $last; // tick at which the histogram is complete
const WIDTH = $width; // of a bin, s
const BINS = $bins; // the last one also counts longer round trips

const binOf: number[] = [];

export default function script(event: Tick): Histogram | undefined {
  const { seq, round_trip } = event.message;
  if (round_trip >= 0) {
    binOf[seq] = Math.min(Math.floor(round_trip / WIDTH), BINS - 1);
  }
  return seq < LAST ? undefined : histogram();
}

function histogram(): Histogram {
  const counts: number[] = new Array(BINS).fill(0);
  binOf.forEach((bin) => {
    counts[bin] += 1;
  });
  const time: number[] = [];
  const ticks: number[] = [];
  counts.forEach((count, bin) => {
    time.push(bin * WIDTH, (bin + 1) * WIDTH);
    ticks.push(count, count);
  });
  return { time, ticks };
}
