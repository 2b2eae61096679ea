"""Starts of runs: a run begins at its first uplift, since the response before it is known in proportion."""

import math

import numpy as np

from ...core.compiled import kernel
from .free import cannot_fall, find_barrier, follow_free
from .lanes import reset, write_result
from .lockstep import step_reach
from .pieces import solve_sample
from .propagators import fill_steps
from .tables import (
    BACK,
    BARE,
    DEGREE,
    FRONT,
    FUSED,
    LEAST_WEIGHT,
    MANY_STEPS,
    NOTHING,
    OMEGA,
    OUT_AIRBORNE,
    OUT_BACK,
    OUT_FRONT,
    OUT_OVERTURNED,
    OVERTURNED,
    PAR_EXACT,
    PAR_GAIN,
    PAR_SIDED,
    PAR_START,
    REGION_CENTRE,
    REGION_DAMPING,
    REGION_LOWER,
    REGION_OFFSET,
    REGION_STIFFNESS,
    REGION_UPPER,
    REST_DOWN,
    REST_UP,
    SPAN,
    STATE_FLOATS,
    STATE_INTEGERS,
    STEP_G0,
    STEP_G1,
    STEP_G2,
    STEP_G2_RISE,
    STEP_G3,
    STEP_GRADE,
    TALLY_BEFORE_UPLIFT,
    TALLY_SAFE,
    TALLY_SAMPLES,
    THETA,
    Work,
)

# Rows of the response before the first uplift, at scale factor 1.
UNIT_THETA, UNIT_OMEGA, UNIT_PEAK = range(3)
UNIT_ROWS = 3


@kernel(**FUSED)
def _first_rise(running, level):
    """Return the index of the first entry of a non-decreasing row that reaches level (its length if none does)."""
    low = 0
    high = running.shape[0]
    while low < high:
        middle = (low + high) // 2
        if running[middle] < level:
            low = middle + 1
        else:
            high = middle
    return low


@kernel(**FUSED)
def _threshold(model, o, zone):
    """Return the minimum acceleration, m/s², that lifts a block that rests rigidly in the state -1 - zone."""
    rest = model.rests[o, -1 - zone]
    return min(rest[REST_UP], rest[REST_DOWN]) / model.parameters[o, PAR_GAIN]


@kernel()
def _unit_response(record, dt, model, steps, o, unit, lifting, sign, enough):
    """Write the response of oscillator o to the unscaled record before uplift into unit (3, n).

    Returns its peak and the number of samples written: it ends at the first peak that is `enough`.

    For an elastic block it is its zone's linear response, as if the zone had no edges; at scale factor f it is f times
    this. For a block that rests rigidly it is the running maximum of the record alone, in the row of peaks. Under a
    vertical component the maximum is of |u''| - sign threshold lifting. Reason: |f u''| exceeds threshold (1 + f
    lifting) if this exceeds threshold/|f|, with the sign of f.
    """
    zone = int(model.parameters[o, PAR_START])
    if zone < 0:
        high = 0.0
        lighter = sign * _threshold(model, o, zone)
        for i in range(record.shape[0]):
            demand = abs(record[i])
            if lifting.shape[0] > 0:
                demand -= lighter * lifting[i]
            high = max(high, demand)
            unit[UNIT_PEAK, i] = high
            if high >= enough:
                return high, i + 1
        return 0.0, record.shape[0]
    x = np.empty(STATE_FLOATS)
    k = np.empty(STATE_INTEGERS, np.int64)
    work = Work(np.empty((3, DEGREE + 1)), np.empty((2, 0)))
    lower = model.tables[o, zone, REGION_LOWER]
    upper = model.tables[o, zone, REGION_UPPER]
    model.tables[o, zone, REGION_LOWER] = -math.inf
    model.tables[o, zone, REGION_UPPER] = math.inf
    reset(x, k, 0.0, 0.0, 0.0, zone, zone)
    gain = -model.parameters[o, PAR_GAIN]
    stiffness = model.tables[o, zone, REGION_STIFFNESS]
    c = model.tables[o, zone, REGION_DAMPING]
    one_step = steps[o, zone, STEP_GRADE] != MANY_STEPS
    g0 = steps[o, zone, STEP_G0]
    g1 = steps[o, zone, STEP_G1]
    g2 = steps[o, zone, STEP_G2]
    g3 = steps[o, zone, STEP_G3]
    g2_rise = steps[o, zone, STEP_G2_RISE]
    theta = 0.0
    omega = 0.0
    high = 0.0
    n = record.shape[0]
    written = n
    for i in range(n - 1):
        high = max(high, abs(theta))
        unit[UNIT_THETA, i] = theta
        unit[UNIT_OMEGA, i] = omega
        unit[UNIT_PEAK, i] = high
        if high >= enough:
            written = i + 1
            break
        push = gain * record[i]
        up = gain * (record[i + 1] - record[i])
        if one_step:
            a = push - stiffness * theta
            theta_end = theta + (omega * g1 + a * g2 + up * g3)
            omega_end = omega + (omega * g0 + a * g1 + up * g2_rise)
            a -= c * omega
            a_end = push + up - stiffness * theta_end - c * omega_end
            turns = omega * omega_end <= 0.0 or (a * omega < 0.0 and a_end * omega > 0.0)
            if not turns or abs(theta) + step_reach(omega, a, a_end, dt) <= high:
                theta = theta_end
                omega = omega_end
                continue
        x[THETA] = theta
        x[OMEGA] = omega
        solve_sample(x, k, model, o, push, up / dt, 0.0, dt, i * dt, work, None, None)
        theta = x[THETA]
        omega = x[OMEGA]
        high = max(high, x[FRONT])
        if k[OVERTURNED] != 0:  # given up: so will be the runs, which continue from here
            written = i + 1
            break
    if written == n:
        x[THETA] = theta
        x[OMEGA] = omega
        x[FRONT] = max(high, abs(theta))
        x[BACK] = x[FRONT]
        unit[UNIT_THETA, n - 1] = theta
        unit[UNIT_OMEGA, n - 1] = omega
        unit[UNIT_PEAK, n - 1] = x[FRONT]
        follow_free(x, k, model, o, (n - 1) * dt, work, None)
        high = x[FRONT]
    model.tables[o, zone, REGION_LOWER] = lower
    model.tables[o, zone, REGION_UPPER] = upper
    return high, written


@kernel(**BARE, fastmath={"nnan", "nsz", "reassoc"})
def _take_in(record, highs, left, dt, start, n):
    """Clear negligible values in a record, write the known values of each span, and return the largest magnitude.

    For a span these are the largest magnitude in it and, if there is room, `left` from its first sample on. It is the
    integral of the magnitude to the end of the record (from above: of chords). Products of denormal numbers would have
    no sign left to decide an event.
    """
    strongest = 0.0
    total = 0.0
    end = abs(record[start + n - 1])
    for span in range((start + n - 1) // SPAN, start // SPAN - 1, -1):
        part = record[span * SPAN : (span + 1) * SPAN]
        high = 0.0
        sum_of_span = 0.0
        for i in range(SPAN):
            size = abs(part[i])
            part[i] = 0.0 if size < NOTHING else part[i]
            high = size if size > high else high
            sum_of_span += size
        highs[span] = high
        strongest = max(strongest, high)
        if left.shape[0] > 0:
            total += sum_of_span
            left[span] = dt * (total - 0.5 * (abs(part[0]) + end))
    return strongest


@kernel(keep=True)
def begin_runs(batch, start, skip, flags_only):
    """Fill in the propagators of a batch, and the first sample of each run with its state there.

    `start`: (theta, omega, region), or empty for all at rest. `skip`: leave out the known part before the first uplift;
    with flags_only also the part that cannot overturn the block any more. Runs that are known completely are written to
    `out`. Returns the other runs: in linear geometry and in exact geometry.
    """
    dt = batch.shaking.dt
    model = batch.model
    which = batch.which
    factors = batch.factors
    first = batch.first
    begin = batch.begin
    shaking_left = batch.shaking_left
    lifting_left = batch.lifting_left
    barriers = batch.barriers
    out = batch.out
    tally = batch.tally
    m = which.shape[0]
    lifts = batch.lifting.shape[0] > 0
    fill_steps(batch.steps, model, dt)
    record = batch.shaking.record
    lifting = batch.lifting
    unit = np.zeros((UNIT_ROWS, batch.shaking.last.max() + 1 if skip else 0))
    unit_peak = 0.0
    written = 0
    uplift = 0.0
    current = -1
    origin = -1
    strongest = 0.0
    sign = 0.0
    lowest = 0.0
    highest = 0.0
    if skip and flags_only:
        for o in range(model.tables.shape[0]):
            find_barrier(model, o, barriers)
    linear = np.empty(m, np.int64)
    exact = np.empty(m, np.int64)
    x, k = np.empty(STATE_FLOATS), np.empty(STATE_INTEGERS, np.int64)
    linear_runs = 0
    exact_runs = 0
    for j in range(m):
        o = which[j]
        start_at = batch.shaking.start[j]
        n = batch.shaking.last[j] + 1
        tally[TALLY_SAMPLES] += n - 1
        if start_at != origin:
            origin = start_at
            current = -1
            record = batch.shaking.record[origin : origin + n]
            strongest = _take_in(batch.shaking.record, batch.shaking.highs, shaking_left, dt, origin, n)
            if lifts:
                _take_in(batch.lifting, batch.lifting_highs, lifting_left, dt, origin, n)
                lifting = batch.lifting[origin : origin + n]
                lowest = lifting.min()
                highest = lifting.max()
        batch.shaking.strongest[j] = strongest
        if lifts and 1.0 + min(factors[j] * lowest, factors[j] * highest) <= LEAST_WEIGHT:
            out[j, :] = math.nan
            out[j, OUT_AIRBORNE] = 1.0
            continue
        zone = int(model.parameters[o, PAR_START])
        begin[j, 3] = zone
        if zone >= 0:
            begin[j, 0] = model.tables[o, zone, REGION_CENTRE]  # (a static lean)
        if start.shape[0] == 3:
            begin[j, 0] = start[0]
            begin[j, 1] = start[1]
            begin[j, 2] = abs(start[0])
            begin[j, 3] = start[2]
        elif (
            skip
            and flags_only
            and cannot_fall(model, o, factors[j], shaking_left[origin // SPAN], lifting_left[origin // SPAN], barriers)
        ):
            tally[TALLY_SAFE] += n - 1
            out[j, OUT_OVERTURNED] = 0.0
            out[j, OUT_AIRBORNE] = 0.0
            continue
        elif skip and (
            zone < 0 or (model.tables[o, zone, REGION_OFFSET] == 0.0 and model.parameters[o, PAR_SIDED] == 0.0)
        ):
            # (a zone with a static offset does not respond in proportion to the factor, nor are peaks of a side known)
            if o != current or (lifts and sign * factors[j] < 0.0):
                current = o
                sign = math.copysign(1.0, factors[j])
                if zone < 0:
                    uplift = _threshold(model, o, zone)
                else:
                    uplift = min(model.tables[o, zone, REGION_UPPER], -model.tables[o, zone, REGION_LOWER])
                least = abs(factors[j])
                q = j + 1
                while q < m and which[q] == o and batch.shaking.start[q] == origin:
                    if lifts and sign * factors[q] < 0.0:
                        break
                    least = min(least, abs(factors[q]))
                    q += 1
                enough = uplift * ((1.0 - 1e-9) / least)
                unit_peak, written = _unit_response(record, dt, model, batch.steps, o, unit, lifting, sign, enough)
            # A part in 10⁹ early: the rounding of a scaled response must not hide the uplift.
            level = uplift * ((1.0 - 1e-9) / abs(factors[j]))
            first[j] = max(_first_rise(unit[UNIT_PEAK, :written], level) - 1, 0)
            if zone >= 0:
                begin[j, 0] = factors[j] * unit[UNIT_THETA, first[j]]
                begin[j, 1] = factors[j] * unit[UNIT_OMEGA, first[j]]
                begin[j, 2] = abs(factors[j]) * unit[UNIT_PEAK, first[j]]
            if first[j] == n - 1 and unit_peak < level:
                reset(x, k, 0.0, 0.0, abs(factors[j]) * unit_peak, zone, zone)
                write_result(out, j, x, k)
                if model.parameters[o, PAR_SIDED] != 0.0:
                    out[j, OUT_FRONT] = 0.0
                    out[j, OUT_BACK] = 0.0
                tally[TALLY_BEFORE_UPLIFT] += n - 1
                continue
        tally[TALLY_BEFORE_UPLIFT] += first[j]
        if model.parameters[o, PAR_EXACT] != 0.0:
            exact[exact_runs] = j
            exact_runs += 1
        else:
            linear[linear_runs] = j
            linear_runs += 1
    return linear[:linear_runs], exact[:exact_runs]
