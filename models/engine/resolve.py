"""Events of the marked lanes, solved together in rounds."""

import numpy as np

from ...core.compiled import kernel
from .lanes import copy_run
from .lockstep import follow
from .low_bounces import lands_soon
from .pieces import at_edge, solve_sample
from .propagators import solve_propagators, step_grade
from .rest import uplift
from .series import rate_bound
from .tables import (
    BARE,
    CROSSES,
    DAMPING,
    EPSILON,
    HARD,
    HELD,
    LANES,
    LINK_HELD,
    NEED,
    NOW,
    OMEGA,
    ONE_PIECE,
    OVERTURNED,
    PIECE_A,
    PIECE_DAMPING,
    PIECE_GAP,
    PIECE_MOVED,
    PIECE_OMEGA,
    PIECE_SLOPE,
    PIECE_SPAN,
    PIECE_SPEED,
    PIECE_STIFFNESS,
    PIECE_SURE,
    PIECE_TIME,
    REGION_GAIN,
    REGION_LOWER,
    REGION_OFFSET,
    REGION_STIFFNESS,
    REGION_UPPER,
    RETURNS,
    STEP_DAMPING,
    STEP_G2_RISE,
    STEP_GRADE,
    STEP_PULL,
    THETA,
    UPWARD,
    WAITS,
)
from .together import finish_pieces, flush_turns, solve_crossings, whole


@kernel(**BARE)
def resolve(w, f, bouncing, model, shaking, end, now, waiting, parked, work):
    """Solve the events of the parked lanes and bring each lane to sample `end`.

    A lane whose record ends earlier is brought to its end. Each round solves the turns that wait, then one event of
    each lane, and takes each lane to its next event. All crossings are solved at once, then all remainders of their
    samples at once, and unusual lanes one by one by `solve_sample`. Returns True if a block has overturned, the number
    of events solved, and the number of bouncing blocks.
    """
    pieces = w.pieces
    zones = w.zones
    record = shaking.record
    dt = shaking.dt
    fallen = False
    solved = np.int64(0)
    per_dt = 1.0 / dt
    recording = work.turns.shape[1] > 0
    while parked > 0 or waiting > 0:
        solved += parked + waiting
        if waiting > 0:
            flush_turns(w, waiting, work.poly)
            waiting = np.int64(0)
        n = np.int64(0)
        for j in range(parked):
            lane = w.parked[j]
            k = w.k[lane]
            x = w.x[lane]
            if k[NEED] == RETURNS:
                k[NEED] = CROSSES  # (its turn is in the peak by now)
            if k[NOW] < 0 or k[NEED] != CROSSES:
                continue
            i = w.parked_at[j]
            amplitude = w.amplitude[lane]
            row = model.tables[w.oscillator[lane], k[NOW]]
            stiffness = row[REGION_STIFFNESS]
            c = x[DAMPING]
            theta = x[THETA]
            omega = x[OMEGA]
            gain = row[REGION_GAIN]
            at = w.start[lane] + i
            force = gain * amplitude * record[at]
            pieces[PIECE_OMEGA * LANES + n] = omega
            pieces[PIECE_A * LANES + n] = force + row[REGION_OFFSET] - stiffness * theta - c * omega
            pieces[PIECE_SLOPE * LANES + n] = gain * amplitude * (record[at + 1] - record[at]) * per_dt
            pieces[PIECE_STIFFNESS * LANES + n] = stiffness
            pieces[PIECE_DAMPING * LANES + n] = c
            pieces[PIECE_SPAN * LANES + n] = dt
            pieces[PIECE_GAP * LANES + n] = row[REGION_LOWER + k[UPWARD]] - theta
            n += 1
        if n > 0:
            solve_crossings(pieces, whole(n))
        read = np.int64(0)
        n = np.int64(0)
        entries = np.int64(0)
        for j in range(parked):
            lane = w.parked[j]
            x = w.x[lane]
            k = w.k[lane]
            o = w.oscillator[lane]
            i = w.parked_at[j]
            amplitude = w.amplitude[lane]
            at = w.start[lane] + i
            force = amplitude * record[at]
            slope = amplitude * (record[at + 1] - record[at]) * per_dt
            region = k[NOW]
            need = HARD
            t = 0.0
            if k[NEED] == WAITS:  # (it has bounced to the end of its sample)
                need = WAITS
            elif region < 0:
                t, force = uplift(model, o, x, k, force, slope, dt, i * dt, None)
                need = WAITS if k[NOW] < 0 else CROSSES
            elif k[NEED] == CROSSES:
                if pieces[PIECE_SURE * LANES + read] == 1.0:
                    t = min(pieces[PIECE_TIME * LANES + read], dt)
                    speed = pieces[PIECE_SPEED * LANES + read]
                    upper = k[UPWARD] != 0
                    x[THETA] = model.tables[o, region, REGION_LOWER + k[UPWARD]]
                    x[OMEGA] = max(speed, 0.0) if upper else min(speed, 0.0)
                    force += slope * t
                    at_edge(x, k, model, o, region, upper, force, slope, dt - t, i * dt + t, None)
                    need = HARD if k[NOW] < 0 else CROSSES
                read += 1
            if k[OVERTURNED] != 0:
                need = WAITS
                fallen = True
            if need == CROSSES:
                # what is left of the sample, in the region entered
                region = k[NOW]
                row = model.tables[o, region]
                stiffness = row[REGION_STIFFNESS]
                offset = row[REGION_OFFSET]
                c = w.steps[o, region, STEP_DAMPING]
                grade = w.steps[o, region, STEP_GRADE]
                if model.links[o, region, LINK_HELD]:
                    c = x[HELD]
                    grade = w.held[lane, STEP_GRADE]
                    if c != w.held[lane, STEP_DAMPING]:
                        grade = step_grade(dt * rate_bound(stiffness, c))
                        if grade == ONE_PIECE and c > 0.0:  # (see `_without_drift`)
                            zones[PIECE_STIFFNESS * LANES + entries] = stiffness
                            zones[PIECE_DAMPING * LANES + entries] = c
                            w.zone_lane[entries] = lane
                            entries += 1
                theta = x[THETA]
                omega = x[OMEGA]
                force *= row[REGION_GAIN]
                slope *= row[REGION_GAIN]
                a = force + offset - stiffness * theta
                if omega == 0.0 and abs(a) <= 2.0 * EPSILON * (abs(force) + abs(offset) + abs(stiffness * theta)):
                    a = 0.0
                outward = omega > 0.0 or (omega == 0.0 and (a > 0.0 or (a == 0.0 and slope > 0.0)))
                if grade == ONE_PIECE and t < dt:
                    pieces[PIECE_OMEGA * LANES + n] = omega
                    pieces[PIECE_A * LANES + n] = a - c * omega
                    pieces[PIECE_SLOPE * LANES + n] = slope
                    pieces[PIECE_STIFFNESS * LANES + n] = stiffness
                    pieces[PIECE_DAMPING * LANES + n] = c
                    pieces[PIECE_SPAN * LANES + n] = dt - t
                    pieces[PIECE_GAP * LANES + n] = (row[REGION_UPPER] if outward else row[REGION_LOWER]) - theta
                    n += 1
                else:
                    need = HARD
            k[NEED] = need
            w.parked_time[j] = t
        if entries > 0:
            solve_propagators(zones, whole(entries), dt)
        for j in range(entries):
            step = w.held[w.zone_lane[j]]
            step[STEP_DAMPING] = zones[PIECE_DAMPING * LANES + j]
            step[STEP_GRADE] = ONE_PIECE
            step[STEP_PULL] = 0.0
            for column in range(STEP_G2_RISE + 1):
                step[column] = zones[(PIECE_GAP + column) * LANES + j]
        if n > 0:
            finish_pieces(pieces, whole(n))
        read = np.int64(0)
        again = np.int64(0)
        for j in range(parked):
            lane = w.parked[j]
            x = w.x[lane]
            k = w.k[lane]
            o = w.oscillator[lane]
            i = w.parked_at[j]
            amplitude = w.amplitude[lane]
            at = w.start[lane] + i
            if k[NEED] == CROSSES:
                read += 1
                if x[THETA] == 0.0 and not recording:
                    force = amplitude * (record[at] + (record[at + 1] - record[at]) * per_dt * w.parked_time[j])
                    if lands_soon(x, k, model, o, force, dt):
                        w.until[lane] = i
                        f.time[bouncing] = w.parked_time[j]
                        copy_run(f.runs, bouncing, w, lane)
                        bouncing += 1
                        w.leaving[w.leaving[LANES]] = lane
                        w.leaving[LANES] += 1
                        continue
                if pieces[PIECE_SURE * LANES + read - 1] == 1.0:
                    x[THETA] += pieces[PIECE_MOVED * LANES + read - 1]
                    x[OMEGA] = pieces[PIECE_SPEED * LANES + read - 1]
                else:
                    k[NEED] = HARD
            if k[NEED] == HARD:
                slope = amplitude * (record[at + 1] - record[at]) * per_dt
                force = amplitude * record[at]
                t = w.parked_time[j]
                solve_sample(x, k, model, o, force, slope, t, dt, i * dt, work, None, None)
                if k[OVERTURNED] != 0:
                    fallen = True
            if k[OVERTURNED] != 0:
                continue
            stop = min(end, shaking.last[w.run[lane]])
            reached, waiting = follow(w, lane, model, shaking, i + 1, stop, now, waiting, recording)
            if reached < stop:
                w.parked[again] = lane
                w.parked_at[again] = reached
                again += 1
        parked = again
    return fallen, solved, bouncing
