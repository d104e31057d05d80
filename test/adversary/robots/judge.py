# SPDX-License-Identifier: BSD-3-Clause
"""judge.py FIRST COUNT [SECONDS [trees|machines|linkages|objects] [JUDGE ...]]: holds random robots against runs beside them, which
know nothing of derivatives, by all judges or by those named."""
import sys
import time
from collections import Counter
from typing import Callable, Dict, List

import beside
import costs
import directions
import generate
import laws
import linkages
import machines
import margins
import methods
import objects
import online
import parameters
import pieces
import returns
import schedules
import starts
import symmetries
import units
from trial import Trial, Verdict, begin

JUDGES: Dict[str, Callable[[Trial], None]] = {
    module.__name__: module.judge for module in (laws, directions, parameters, pieces, starts, schedules, returns, symmetries, costs,
                                               methods, online, beside, units, margins)}
DRAW = {"trees": generate.draw, "machines": machines.draw, "linkages": linkages.draw, "objects": objects.draw}


def main(words: List[str]) -> int:
    """Exit code 1 where something is contradicted."""
    first, count = int(words[0]), int(words[1])
    budget = float(words[2]) if len(words) > 2 else 1e9
    draw = DRAW[words.pop(3)] if words[3:4] and words[3] in DRAW else generate.draw
    judges = words[3:] or list(JUDGES)
    unknown = [name for name in judges if name not in JUDGES]
    if unknown:
        print(f"no judge {', '.join(unknown)}: {', '.join(JUDGES)}", file=sys.stderr)
        return 2
    started, counts, wrong, done = time.process_time(), Counter(), 0, 0
    for seed in range(first, first + count):
        if time.process_time() - started > budget:
            break
        verdict = Verdict()
        trial = begin(draw, seed, verdict)
        for name in judges if trial else ():
            JUDGES[name](trial)
        counts += verdict.counts
        done += 1
        for line in verdict.contradictions:
            wrong += 1
            print(f"robot {seed}: {line}", flush=True)
        if done % 20 == 0:
            print(f"{done} of {count} robots, {wrong} contradictions, {time.process_time() - started:.0f} s",
                  file=sys.stderr, flush=True)
    print(f"{done} robots from {first} on, {wrong} contradictions")
    for what, number in sorted(counts.items()):
        print(f"  {number:6d} {what}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
