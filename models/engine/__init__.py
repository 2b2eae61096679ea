"""Compiled engine: one rocking run from event to event, without approximation in time.

Floats and arrays in, floats and arrays out; labels, units and validation live above.  An oscillator is a table of
regions (`REGION_*` columns) joined by links (`LINK_*` columns): nothing here assumes three of them, or mirror symmetry.

Between two samples the floor acceleration is linear, so inside one region the motion is known in closed form.  A sample
that provably holds no event costs one multiplication by a precomputed propagator; any other is cut at its events, each
found to rounding on the local Taylor series.  The exact (sin/cos) geometry has no closed form, and uses the same series
method with an error control of its own.

Why a step is event-free: the acceleration a(t) of a linear region under linear forcing solves a'' + c a' + K a = 0,
whose zeros are at least pi/sqrt(K) apart (at most one zero for K <= c²/4).  Steps satisfy sqrt|K| h <= 1/2, so a has at
most one zero, the velocity at most two monotone parts, and the signs of velocity and acceleration at both ends decide.

How a batch runs (`models.runs.run_batch` calls three entry points).  `starts.begin_runs` fills in the propagators and
finds the first sample of each run: what precedes its uplift is known in proportion.  `linear_runs.run_lanes` takes runs
in linear geometry in lockstep, a lane each; `exact_runs.run_exact` takes those in exact geometry, each with a clock of
its own.  The runs of a batch are of one record or of several of one step, which lie one after the other (see
`tables.Shaking`).

All records that go in lockstep begin together, and a lane whose record has ended stays empty.  Where the lanes go over
several records, the samples of a few steps are written time by time first, so that those of all lanes lie side by side:
the steps stay vectors.  A record that ends between two of the samples at which all lanes meet is followed to its end
alone.

In lockstep, `advance` takes the plain steps of a block of lanes at once, in vectors, and sorts the lanes that it marks:
a turn is noted down, a lane with another event is parked.  Every few samples `resolve` solves the events that have
gathered: all turns together, all crossings together, and the remainders of their samples together, in loops that are
written out so that they become vector code, too.  Unusual samples are solved one by one (`solve_sample`, piece by
piece: series, first event, action), and then each lane catches up with the others.  A block at rest has no lane until
the sample that lifts it.  Nor has a block that bounces low about theta = 0, every few samples or more often: such
blocks gather, and `bounce` follows them together, flight by flight, until they rest or rise.  The results of a run do
not depend on the other runs of its batch, to the last bit.  After the record, `follow_free` follows each block until
nothing can change.

In exact geometry each round takes one piece of every lane in vectors, from where its clock stands to the end of the
sample: its series to degree 12, a bound of what is left out, and signs and bounds that prove what the piece holds: no
event, one edge, or something else.  Edges are found together, too, and what is left of the sample is the next piece;
all else goes the general way, piece by piece.  What ends a piece depends on the state and the shaking alone, never on
peaks or on what is stored, so that every way to ask for a run gives the same bits.
"""
