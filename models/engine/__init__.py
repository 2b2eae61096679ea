"""Compiled engine: one rocking run from event to event, without approximation in time.

Floats and arrays in, floats and arrays out; labels, units and validation live above.  An oscillator is a table of
regions (`REGION_*` columns) joined by links (`LINK_*` columns): nothing here assumes three of them, or mirror symmetry.

Between two samples the floor acceleration is linear, so inside one region the motion is known in closed form. A sample
that provably has no event costs one multiplication by a precomputed propagator. Any other is divided at its events,
each found to rounding on the local Taylor series. The exact (sin/cos) geometry has no closed form, and uses the same
series method with its own error control.

Proof that a step is event-free: the acceleration a(t) of a linear region under linear forcing solves a'' + c a' + K a =
0. Its zeros are at least pi/sqrt(K) apart (at most one zero for K <= c²/4). Steps satisfy sqrt|K| h <= 1/2, so a has at
most one zero and the velocity at most two monotone parts. The signs of velocity and acceleration at both ends therefore
decide.

A batch runs in three steps (`models.runs.run_batch` calls three entry points). The function `starts.begin_runs` fills
in the propagators and finds the first sample of each run: the response before its uplift is known in proportion.
`linear_runs.run_lanes` takes runs in linear geometry in lockstep, a lane each. `exact_runs.run_exact` takes runs in
exact geometry, each with its own clock. The runs of a batch are of one record or of several of one step, which lie one
after the other (see `tables.Shaking`).

All records in lockstep begin together, and a lane whose record has ended stays empty. Lanes may cover several records.
The samples of a few steps are then first written time by time, so that samples of all lanes are adjacent: the steps
stay vectors. A record that ends between two of the samples at which all lanes meet is followed to its end alone.

In lockstep, `advance` takes the plain steps of a block of lanes at once, in vectors, and sorts the lanes that it marks.
A turn is noted, a lane with another event is parked. Every few samples `resolve` solves the gathered events: all turns
together, all crossings together, and the remainders of their samples together. Its loops are written out so that they
become vector code, too. Unusual samples are solved one by one by `solve_sample`, piece by piece: series, first event,
action. Each lane then catches up with the others.

A block at rest has no lane until the sample that lifts it. The same is true for a block that bounces low about theta =
0, every few samples or more often. Such blocks gather, and `bounce` follows them together, flight by flight, until they
rest or rise. The results of a run do not depend on the other runs of its batch, to the last bit. When the record ends,
`follow_free` follows each block until nothing can change.

In exact geometry each round takes one piece of every lane in vectors, from its clock to the end of the sample. It
computes the series to degree 12 and a bound of the remainder. Signs and bounds prove the content of the piece: no
event, one edge, or something else. Edges are found together, too, and the rest of the sample is the next piece; all
else is solved in the general way, piece by piece. The end of a piece depends on the state and the motion alone, never
on peaks or on stored results. Every kind of request for a run therefore gives bit-identical results.
"""
