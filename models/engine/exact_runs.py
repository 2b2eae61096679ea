"""Driver of runs in exact geometry, one after the other, with the cheap step for samples without an event."""

import numpy as np

from ...compiled import kernel
from .free import follow_free, is_safe
from .lanes import begin_run, store_fallen, store_sample, write_result
from .pieces import solve_sample
from .rest import span_maxima, until_uplift
from .series import first_terms, sine_and_cosine, terms_end
from .tables import (
    DEGREE,
    FUSED,
    NOW,
    OMEGA,
    OVERTURNED,
    PAR_EXACT,
    PAR_GAIN,
    REGION_CENTRE,
    REGION_GAIN,
    REGION_LOWER,
    REGION_STIFFNESS,
    REGION_UPPER,
    REST_DOWN,
    REST_UP,
    SAFE,
    SAFETY_INTERVAL,
    STATE_FLOATS,
    STATE_INTEGERS,
    TALLY_EVENTS,
    TALLY_OVERTURNED,
    TALLY_SAFE,
    THETA,
    TURNS,
    Work,
)


@kernel(**FUSED)
def glide(x, k, model, o, force, slope, h):
    """Take a step in exact geometry at degree 12 if it provably holds no event; return whether it was taken.

    The velocity keeps its sign where the acceleration does and it has the same at both ends, or where it is larger than
    the acceleration can change it.
    """
    region = k[NOW]
    theta = x[THETA]
    w0 = x[OMEGA]
    p2 = -model.tables[o, region, REGION_STIFFNESS]
    if w0 == 0.0 or 4.0 * p2 * h * h > 1.0:
        return False
    sine, cosine = sine_and_cosine(model.tables[o, region, REGION_CENTRE] - theta)
    lever = model.tables[o, region, REGION_GAIN] * model.parameters[o, PAR_EXACT]
    force *= lever
    slope *= lever
    a0 = force * cosine - p2 * sine
    _, _, _, of_w, of_a = first_terms(sine, cosine, w0, a0, p2, force, slope)
    w2, w3, w4, w5, w6, w7, w8, w9, w10, w11 = of_w
    a1, a2, a3, a4, a5, a6, a7, a8, a9, a10 = of_a
    if not terms_end(w0, a0, a1, a9, a10, h):
        return False
    # (in pairs: the last terms are the last to be known)
    square = h * h
    sixth = square * square * square
    speed = (w6 + h * w7) + square * ((w8 + h * w9) + square * (w10 + h * w11))
    speed = w0 + (h * (a0 + h * (w2 + h * (w3 + h * (w4 + h * w5)))) + sixth * speed)
    change = abs(a6) + h * (abs(a7) + h * (abs(a8) + h * (abs(a9) + h * abs(a10))))
    change = h * (abs(a1) + h * (abs(a2) + h * (abs(a3) + h * (abs(a4) + h * (abs(a5) + h * change)))))
    steady = abs(a0) > change and w0 * speed > 0.0
    if not steady and abs(w0) <= h * (abs(a0) + change):
        return False
    late = (w6 * (1.0 / 7.0) + h * w7 * (1.0 / 8.0)) + square * (w8 * (1.0 / 9.0) + h * w9 * (1.0 / 10.0))
    late += square * square * (w10 * (1.0 / 11.0) + h * w11 * (1.0 / 12.0))
    moved = w3 * (1.0 / 4.0) + h * (w4 * (1.0 / 5.0) + h * w5 * (1.0 / 6.0))
    moved = h * (w0 + h * (0.5 * a0 + h * (w2 * (1.0 / 3.0) + h * moved)))
    theta += moved + sixth * h * late
    if not model.tables[o, region, REGION_LOWER] < theta < model.tables[o, region, REGION_UPPER]:
        return False
    x[THETA] = theta
    x[OMEGA] = speed
    return True


@kernel(keep=True)
def run_exact(batch, runs):
    """Run the runs (r,) of a batch in exact geometry: every sample of a moving block is solved by its own series.

    Returns the number of turning points of the last one.
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
    x = np.empty(STATE_FLOATS)
    k = np.empty(STATE_INTEGERS, np.int64)
    work = Work(np.empty((3, DEGREE + 1)), batch.turns)
    after_record = Work(work.poly, np.empty((2, 0)))
    trig = np.empty((2, DEGREE + 1))
    n = record.shape[0]
    store = history.shape[1] == n
    looking = shaking_left.shape[0] > 0
    highs = span_maxima(record)
    found = 0
    for r in range(runs.shape[0]):
        j = runs[r]
        o = which[j]
        begin_run(x, k, model, o, begin[j])
        amplitude = -model.parameters[o, PAR_GAIN] * factors[j]
        i = first[j] - 1
        while True:
            i += 1
            if store:
                store_sample(history, i, x, k, model, o)
            if i == n - 1:
                break
            force = amplitude * record[i]
            end = amplitude * record[i + 1]
            looks = looking and i % SAFETY_INTERVAL == 0
            if looks and is_safe(x, k, model, o, abs(amplitude) * shaking_left[i], barriers):
                k[SAFE] = 1
                tally[TALLY_SAFE] += n - 1 - i
                break
            if k[NOW] < 0:
                right = model.rests[o, -1 - k[NOW], REST_UP]
                left = -model.rests[o, -1 - k[NOW], REST_DOWN]
                if max(force, end) <= right and min(force, end) >= left:
                    lifted = i + 1 if store else until_uplift(record, highs, amplitude, right, left, i)
                    stop = (i // SAFETY_INTERVAL + 1) * SAFETY_INTERVAL if looking else n - 1
                    i = max(i, min(lifted, stop, n - 1) - 1)
                    continue
            tally[TALLY_EVENTS] += 1
            slope = (end - force) / dt
            if k[NOW] < 0 or x[THETA] == 0.0 or not glide(x, k, model, o, force, slope, dt):
                t = 0.0
                solve_sample(x, k, model, o, force, slope, t, dt, i * dt, work, trig)
            if k[OVERTURNED] != 0:
                tally[TALLY_OVERTURNED] += n - 2 - i
                if store:
                    store_fallen(history, i + 1, x)
                break
        found = k[TURNS]
        if k[OVERTURNED] == 0 and k[SAFE] == 0:
            follow_free(x, k, model, o, (n - 1) * dt, after_record, trig)
        write_result(out, j, x, k)
    return found
