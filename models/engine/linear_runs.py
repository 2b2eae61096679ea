"""Driver of runs in linear geometry, which go in lockstep, over one record or over one each."""

import numpy as np

from ...core.compiled import kernel
from .free import follow_free, is_safe
from .lanes import (
    Lanes,
    begin_run,
    clear_lane,
    copy_run,
    fetch_lane,
    freeze_lane,
    leave_lane,
    no_runs,
    rejoin,
    set_amplitude,
    sort,
    store_fallen,
    store_sample,
    take_lane,
    write_result,
)
from .lockstep import BLOCK, advance, follow
from .low_bounces import bounce, no_flights
from .resolve import resolve
from .tables import (
    DEGREE,
    LANE_ROWS,
    LANES,
    NEED,
    NOW,
    OVERTURNED,
    PAR_GAIN,
    ROW_EVEN,
    ROW_ODD,
    SAFE,
    SAFETY_INTERVAL,
    SPAN,
    STATE_FLOATS,
    STATE_INTEGERS,
    STEP_COLUMNS,
    STEP_DAMPING,
    TALLY_EVENTS,
    TALLY_OVERTURNED,
    TALLY_SAFE,
    THETA,
    TILE,
    TURN_COLUMNS,
    TURNS,
    WAITS,
    Work,
)
from .together import no_pieces

# Bouncing blocks are followed together at a fixed interval of samples: their meetings must not depend on the other
# runs.
BOUNCE_INTERVAL = 16 * TILE


@kernel(inline="always")
def _left_at(left, start, i, last):
    """Return the integral over the rest of a record from sample i, a multiple of SPAN or the record's last."""
    return left[(start + i) // SPAN] if i < last else 0.0


@kernel(keep=True)
def run_lanes(batch, runs, ends):
    """Run up to LANES runs of a batch in linear geometry in lockstep; runs (r,) are sorted by their first sample.

    `ends`: the numbers of their last samples, in ascending order. All records begin together. A run joins at its first
    sample. It leaves at the last one of its record, when it has overturned, or when it is sure not to (if
    `shaking_left` is given). Between, only marked lanes leave the lockstep, and a block at rest has no lane until the
    sample that lifts it. Returns the number of turning points of the last run to end.
    """
    shaking = batch.shaking
    dt = shaking.dt
    last = shaking.last
    model = batch.model
    which = batch.which
    factors = batch.factors
    first = batch.first
    begin = batch.begin
    shaking_left = batch.shaking_left
    barriers = batch.barriers
    out = batch.out
    history = batch.history
    tally = batch.tally
    shared = True
    for j in runs:
        shared = shared and shaking.start[j] == shaking.start[runs[0]]
    forces = np.zeros((TILE + 1) * BLOCK)
    marks = np.zeros(LANES, np.uint8)
    w = Lanes(
        rows=np.empty(LANE_ROWS * LANES),
        marks=marks,
        words=marks.view(np.int64),
        x=np.empty((LANES, STATE_FLOATS)),
        k=np.empty((LANES, STATE_INTEGERS), np.int64),
        held=np.zeros((LANES, STEP_COLUMNS)),
        steps=batch.steps,
        oscillator=np.empty(LANES, np.int64),
        run=np.empty(LANES, np.int64),
        amplitude=np.empty(LANES),
        start=np.empty(LANES, np.int64),
        pieces=no_pieces(LANES),
        zones=no_pieces(LANES),
        zone_lane=np.empty(LANES, np.int64),
        turns=no_pieces(TURN_COLUMNS),
        turn_lane=np.empty(TURN_COLUMNS, np.int64),
        parked=np.empty(LANES, np.int64),
        parked_at=np.empty(LANES, np.int64),
        parked_time=np.empty(LANES),
        leaving=np.zeros(LANES + 1, np.int64),
        until=np.empty(LANES, np.int64),
    )
    z = no_runs(runs.shape[0])
    b = no_runs(runs.shape[0])
    f = no_flights(b)
    work = Work(np.empty((3, DEGREE + 1)), batch.turns)
    after_record = Work(work.poly, np.empty((2, 0)))
    for lane in range(LANES):
        clear_lane(w.rows, lane)
    longest = ends[ends.shape[0] - 1]
    ended = np.int64(0)
    store = history.shape[1] > 0
    recording = work.turns.shape[1] > 0
    active = np.int64(0)
    asleep = np.int64(0)
    bouncing = np.int64(0)
    next_awake = longest
    joined = np.int64(0)
    now = np.int64(ROW_EVEN)
    turns = np.int64(0)
    i = first[runs[0]]
    while True:
        # up to the next multiple of TILE: the meeting samples must not depend on the other runs
        end = min(i + 1 if store else (i // TILE + 1) * TILE, longest)
        ending = ends[ended] <= end
        while ended + 1 < ends.shape[0] and ends[ended] <= end:
            ended += 1
        if store and active > 0:
            fetch_lane(w, np.int64(0), now)
            store_sample(history, i, w.x[0], w.k[0], model, w.oscillator[0])
        if store and asleep > 0:
            store_sample(history, i, z.x[0], z.k[0], model, z.oscillator[0])
        if store and bouncing > 0:
            store_sample(history, i, b.x[0], b.k[0], model, b.oscillator[0])
        waiting = np.int64(0)
        parked = np.int64(0)
        if ending and ends[0] < end:
            for lane in range(active):
                if last[w.run[lane]] < end:  # its record ends before the others meet
                    fetch_lane(w, lane, now)
                    freeze_lane(w.rows, lane)
                    w.k[lane, NEED] = WAITS
                    w.parked[parked] = lane
                    w.parked_at[parked] = i - 1
                    parked += 1
            tally[TALLY_EVENTS] -= parked  # (that is no event)
        for lane in range(0, active, BLOCK):
            n_lanes = min(BLOCK, active - lane)
            if shared:
                waiting, parked = advance(w, None, lane, n_lanes, shaking, i, end, now, waiting, parked)
            else:
                waiting, parked = advance(w, forces, lane, n_lanes, shaking, i, end, now, waiting, parked)
        if (end - i) % 2 == 1:
            now = ROW_ODD if now == ROW_EVEN else ROW_EVEN
        meeting = store or end % BOUNCE_INTERVAL == 0
        if bouncing > 0 and (meeting or ending):
            tally[TALLY_EVENTS] += bounce(f, bouncing, model, shaking, end, meeting, work)
            active, bouncing, parked = rejoin(w, f, active, bouncing, parked, last, end)
        if next_awake < end:
            next_awake = longest
            j = np.int64(0)
            while j < asleep:
                if z.until[j] >= min(end, last[z.run[j]]):
                    next_awake = min(next_awake, z.until[j])
                    j += 1
                    continue
                take_lane(w, active, z, j)
                w.parked[parked] = active
                w.parked_at[parked] = z.until[j]
                parked += 1
                active += 1
                asleep -= 1
                copy_run(z, j, z, asleep)
        while joined < runs.shape[0] and (first[runs[joined]] < end or last[runs[joined]] <= end):
            # a run joins alone, and catches up
            j = runs[joined]
            o = which[j]
            x = w.x[active]
            k = w.k[active]
            w.oscillator[active] = o
            w.run[active] = j
            w.start[active] = shaking.start[j]
            w.held[active, STEP_DAMPING] = -1.0
            begin_run(x, k, model, o, begin[j])
            set_amplitude(w, active, -model.parameters[o, PAR_GAIN] * factors[j])
            if store:
                store_sample(history, i, x, k, model, o)
            stop = min(end, last[j])
            reached, waiting = follow(w, active, model, shaking, first[j], stop, now, waiting, recording)
            joined += 1
            if w.leaving[LANES] > 0:
                w.leaving[LANES] = 0
                copy_run(z, asleep, w, active)
                next_awake = min(next_awake, z.until[asleep])
                asleep += 1
                continue
            if reached < stop:
                w.parked[parked] = active
                w.parked_at[parked] = reached
                parked += 1
            active += 1
        leaving = False
        while parked > 0 or waiting > 0:
            fallen, solved, bouncing = resolve(w, f, bouncing, model, shaking, end, now, waiting, parked, work)
            tally[TALLY_EVENTS] += solved
            leaving = leaving or fallen
            waiting = np.int64(0)
            parked = np.int64(0)
            if w.leaving[LANES] > 0:
                # from the last lane on, so that none of those that are left changes its place
                sort(w.leaving, w.leaving[LANES])
                for j in range(w.leaving[LANES] - 1, -1, -1):
                    if w.k[w.leaving[j], NOW] < 0:
                        copy_run(z, asleep, w, w.leaving[j])
                        next_awake = min(next_awake, z.until[asleep])
                        asleep += 1
                    active -= 1
                    leave_lane(w, w.leaving[j], active)
                w.leaving[LANES] = 0
            if bouncing > 0 and (meeting or ending):  # (all lanes have reached `end`)
                tally[TALLY_EVENTS] += bounce(f, bouncing, model, shaking, end, meeting, work)
                active, bouncing, parked = rejoin(w, f, active, bouncing, parked, last, end)
        i = end
        looking = i % SAFETY_INTERVAL == 0
        if shaking_left.shape[0] > 0 and (looking or ending):
            for lane in range(active):
                j = w.run[lane]
                if w.k[lane, OVERTURNED] == 0 and (looking or last[j] <= i):
                    fetch_lane(w, lane, now)
                    push = abs(w.amplitude[lane]) * _left_at(shaking_left, shaking.start[j], i, last[j])
                    if is_safe(w.x[lane], w.k[lane], model, w.oscillator[lane], push, 0.0, barriers):
                        w.k[lane, SAFE] = 1
                        leaving = True
            j = np.int64(0)
            while j < asleep:
                left = last[z.run[j]] - i
                push = abs(z.amplitude[j]) * _left_at(shaking_left, shaking.start[z.run[j]], i, last[z.run[j]])
                if (not looking and left > 0) or not is_safe(
                    z.x[j], z.k[j], model, z.oscillator[j], push, 0.0, barriers
                ):
                    j += 1
                    continue
                z.k[j, SAFE] = 1
                tally[TALLY_SAFE] += max(left, 0)
                turns = z.k[j, TURNS]
                write_result(out, z.run[j], z.x[j], z.k[j])
                asleep -= 1
                copy_run(z, j, z, asleep)
        if leaving:
            lane = np.int64(0)
            while lane < active:
                if w.k[lane, OVERTURNED] == 0 and w.k[lane, SAFE] == 0:
                    lane += 1
                    continue
                tally[TALLY_SAFE if w.k[lane, SAFE] != 0 else TALLY_OVERTURNED] += max(last[w.run[lane]] - i, 0)
                write_result(out, w.run[lane], w.x[lane], w.k[lane])
                turns = w.k[lane, TURNS]
                if store:
                    store_fallen(history, i, w.x[lane])
                active -= 1
                leave_lane(w, lane, active)
        if ending:
            # free motion after the record; those asleep take their lanes again for it
            j = np.int64(0)
            while j < asleep:
                if last[z.run[j]] > i:
                    j += 1
                    continue
                take_lane(w, active, z, j)
                w.rows[now * LANES + active] = w.x[active, THETA]
                w.rows[(now + 1) * LANES + active] = 0.0
                active += 1
                asleep -= 1
                copy_run(z, j, z, asleep)
            if store and active > 0:
                fetch_lane(w, np.int64(0), now)
                store_sample(history, i, w.x[0], w.k[0], model, w.oscillator[0])
            lane = np.int64(0)
            while lane < active:
                j = w.run[lane]
                if last[j] > i:
                    lane += 1
                    continue
                fetch_lane(w, lane, now)
                turns = w.k[lane, TURNS]
                follow_free(w.x[lane], w.k[lane], model, w.oscillator[lane], last[j] * dt, after_record, None)
                write_result(out, j, w.x[lane], w.k[lane])
                active -= 1
                leave_lane(w, lane, active)
        if active + asleep + bouncing == 0 and joined == runs.shape[0]:
            return turns
