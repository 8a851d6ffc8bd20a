#pragma once

/// @file
/// A capture from end to end. Thread safety: pure function; different problems may run in parallel.

#include "grapnel/capture/capture_problem.hpp"
#include "grapnel/capture/capture_steps.hpp"
#include "grapnel/capture/capture_system.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// Approach, contact, impact and motion afterwards, with time series and ledger. A numerical failure is not thrown: the
/// result has status `failed`, says what happened where and when, and keeps all that was computed before.
/// With a sink its samples go there block by block; the result's series then holds the last block alone.
/// @throws CaptureProblemError or ModelError if the problem contradicts itself.
CaptureResult simulate_capture(const CaptureProblem& problem, const CaptureProgress& progress = {},
                               CaptureDetail detail = CaptureDetail::full, SeriesSink* sink = nullptr);

/// The impact at the end of the approach alone, for studies: the joints follow their plan exactly to the planned final
/// configuration, of which nothing is recorded, and nothing follows the impact. Tracking errors, envelopes on the way,
/// and grips that close at other times than the approach's end do not show. @throws as simulate_capture().
CaptureResult simulate_impact_only(const CaptureProblem& problem, CaptureDetail detail = CaptureDetail::full,
                                   const CaptureProgress& progress = {});

}  // namespace grapnel
