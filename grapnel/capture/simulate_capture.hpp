#pragma once

/// @file
/// A capture from start to end.
/// Public, kept stable.

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/result/time_series.hpp"

namespace grapnel {

/// Simulates approach, contact, impact and motion afterwards, with time series and ledger. A numerical failure is not
/// thrown: the result has status `failed`, states the time and cause of the failure, and keeps all earlier results.
/// With a sink, samples are passed to it in blocks; the result's series then holds only the last block. @throws
/// CaptureProblemError or ModelError if the problem contradicts itself.
CaptureResult simulate_capture(const CaptureProblem& problem, const CaptureProgress& progress = {},
                               CaptureDetail detail = CaptureDetail::full, SeriesSink* sink = nullptr);

/// Simulates only the impact at the end of the approach, for studies: the joints follow their plan exactly to the
/// planned final configuration, without recording, and no motion follows. Tracking errors, envelopes during the
/// approach, and grasps that close at other times than the approach's end are not included. @throws as
/// simulate_capture().
CaptureResult simulate_impact_only(const CaptureProblem& problem, CaptureDetail detail = CaptureDetail::full,
                                   const CaptureProgress& progress = {});

}  // namespace grapnel
