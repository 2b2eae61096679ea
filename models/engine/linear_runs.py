"""Driver of runs in linear geometry, which go in lockstep over one record."""

import numpy as np

from ...compiled import kernel
from .bounces import bounce, no_flights
from .free import follow_free, is_safe
from .lanes import (
    Lanes,
    begin_run,
    clear_lane,
    fetch_lane,
    leave_lane,
    move_apart,
    no_runs,
    rejoin,
    set_amplitude,
    set_apart,
    sort,
    store_fallen,
    store_sample,
    take_lane,
    write_result,
)
from .lockstep import advance, follow
from .resolve import resolve
from .rest import span_maxima
from .tables import (
    DEGREE,
    LANE_ROWS,
    LANES,
    NOW,
    OVERTURNED,
    PAR_GAIN,
    ROW_EVEN,
    ROW_ODD,
    SAFE,
    SAFETY_INTERVAL,
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
    Shaking,
    Work,
)
from .together import no_pieces

# Lanes that take the steps of a tile in lockstep: a block of them stays in the fastest cache.
BLOCK = 176
# Bouncing blocks are followed together every so many samples: their meetings must not depend on the other runs.
BOUNCE_INTERVAL = 16 * TILE


@kernel(keep=True)
def run_lanes(batch, runs):
    """Run up to LANES runs of a batch in linear geometry in lockstep; runs (r,) are sorted by their first sample.

    A run joins at its first sample and leaves when it has overturned, or is sure not to (where shaking_left is given);
    between, only marked lanes leave the lockstep, and a block at rest has no lane until the sample that lifts it.
    Returns the number of turning points of the last run to end.
    """
    record = batch.record
    dt = batch.dt
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
    marks = np.zeros(LANES, np.uint8)
    w = Lanes(
        rows=np.empty(LANE_ROWS * LANES),
        marks=marks,
        words=marks.view(np.int64),
        x=np.empty((LANES, STATE_FLOATS)),
        k=np.empty((LANES, STATE_INTEGERS), np.int64),
        own=np.zeros((LANES, STEP_COLUMNS)),
        steps=batch.steps,
        oscillator=np.empty(LANES, np.int64),
        run=np.empty(LANES, np.int64),
        amplitude=np.empty(LANES),
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
    n = record.shape[0]
    store = history.shape[1] == n
    recording = work.turns.shape[1] > 0
    active = np.int64(0)
    asleep = np.int64(0)
    bouncing = np.int64(0)
    next_awake = n
    joined = np.int64(0)
    now = np.int64(ROW_EVEN)
    found = np.int64(0)
    highs = span_maxima(record)
    shaking = Shaking(record, dt, highs, np.max(highs))
    i = first[runs[0]]
    while True:
        # up to the next multiple of TILE: the meeting samples must not depend on the other runs
        end = min(i + 1 if store else (i // TILE + 1) * TILE, n - 1)
        if store and active > 0:
            fetch_lane(w, np.int64(0), now)
            store_sample(history, i, w.x[0], w.k[0], model, w.oscillator[0])
        if store and asleep > 0:
            store_sample(history, i, z.x[0], z.k[0], model, z.oscillator[0])
        if store and bouncing > 0:
            store_sample(history, i, b.x[0], b.k[0], model, b.oscillator[0])
        waiting = np.int64(0)
        parked = np.int64(0)
        for lane in range(0, active, BLOCK):
            n_lanes = min(BLOCK, active - lane)
            waiting, parked = advance(w, lane, n_lanes, shaking, i, end, now, waiting, parked)
        if (end - i) % 2 == 1:
            now = ROW_ODD if now == ROW_EVEN else ROW_EVEN
        meeting = store or end % BOUNCE_INTERVAL == 0 or end == n - 1
        if bouncing > 0 and meeting:
            tally[TALLY_EVENTS] += bounce(f, bouncing, model, shaking, end, work)
            active, bouncing, parked = rejoin(w, b, active, bouncing, parked, end == n - 1)
        if next_awake < end:
            next_awake = n
            j = np.int64(0)
            while j < asleep:
                if z.until[j] >= end:
                    next_awake = min(next_awake, z.until[j])
                    j += 1
                    continue
                take_lane(w, active, z, j)
                w.parked[parked] = active
                w.parked_at[parked] = z.until[j]
                parked += 1
                active += 1
                asleep -= 1
                move_apart(z, asleep, j)
        while joined < runs.shape[0] and (first[runs[joined]] < end or end == n - 1):
            # a run joins alone, and catches up
            j = runs[joined]
            o = which[j]
            x = w.x[active]
            k = w.k[active]
            w.oscillator[active] = o
            w.run[active] = j
            w.own[active, STEP_DAMPING] = -1.0
            begin_run(x, k, model, o, begin[j])
            set_amplitude(w, active, -model.parameters[o, PAR_GAIN] * factors[j])
            if store:
                store_sample(history, i, x, k, model, o)
            reached, waiting = follow(w, active, model, shaking, first[j], end, now, waiting, recording)
            joined += 1
            if w.leaving[LANES] > 0:
                w.leaving[LANES] = 0
                set_apart(w, active, z, asleep)
                next_awake = min(next_awake, z.until[asleep])
                asleep += 1
                continue
            if reached < end:
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
                        set_apart(w, w.leaving[j], z, asleep)
                        next_awake = min(next_awake, z.until[asleep])
                        asleep += 1
                    active -= 1
                    leave_lane(w, w.leaving[j], active)
                w.leaving[LANES] = 0
            if bouncing > 0 and meeting:  # (all lanes have reached `end`)
                tally[TALLY_EVENTS] += bounce(f, bouncing, model, shaking, end, work)
                active, bouncing, parked = rejoin(w, b, active, bouncing, parked, end == n - 1)
        i = end
        if shaking_left.shape[0] > 0 and (i % SAFETY_INTERVAL == 0 or i == n - 1):
            for lane in range(active):
                if w.k[lane, OVERTURNED] == 0:
                    fetch_lane(w, lane, now)
                    push = abs(w.amplitude[lane]) * shaking_left[i]
                    if is_safe(w.x[lane], w.k[lane], model, w.oscillator[lane], push, 0.0, barriers):
                        w.k[lane, SAFE] = 1
                        leaving = True
            j = np.int64(0)
            while j < asleep:
                push = abs(z.amplitude[j]) * shaking_left[i]
                if not is_safe(z.x[j], z.k[j], model, z.oscillator[j], push, 0.0, barriers):
                    j += 1
                    continue
                z.k[j, SAFE] = 1
                tally[TALLY_SAFE] += n - 1 - i
                found = z.k[j, TURNS]
                write_result(out, z.run[j], z.x[j], z.k[j])
                asleep -= 1
                move_apart(z, asleep, j)
        if leaving:
            lane = np.int64(0)
            while lane < active:
                if w.k[lane, OVERTURNED] == 0 and w.k[lane, SAFE] == 0:
                    lane += 1
                    continue
                tally[TALLY_SAFE if w.k[lane, SAFE] != 0 else TALLY_OVERTURNED] += n - 1 - i
                write_result(out, w.run[lane], w.x[lane], w.k[lane])
                found = w.k[lane, TURNS]
                if store:
                    store_fallen(history, i, w.x[lane])
                active -= 1
                leave_lane(w, lane, active)
        if i == n - 1 or (active + asleep + bouncing == 0 and joined == runs.shape[0]):
            break
    for j in range(asleep):  # they take their lanes again, and end with the others
        take_lane(w, active, z, j)
        w.rows[now * LANES + active] = w.x[active, THETA]
        w.rows[(now + 1) * LANES + active] = 0.0
        active += 1
    if store and active > 0:
        fetch_lane(w, np.int64(0), now)
        store_sample(history, n - 1, w.x[0], w.k[0], model, w.oscillator[0])
    for lane in range(active):
        fetch_lane(w, lane, now)
        found = w.k[lane, TURNS]
        follow_free(w.x[lane], w.k[lane], model, w.oscillator[lane], (n - 1) * dt, after_record, None)
        write_result(out, w.run[lane], w.x[lane], w.k[lane])
    return found
