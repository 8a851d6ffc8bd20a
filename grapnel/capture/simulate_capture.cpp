#include "grapnel/capture/simulate_capture.hpp"

namespace grapnel {
namespace {

CaptureResult simulate(const CaptureProblem& problem, CaptureDetail detail, const CaptureProgress& progress,
                       CaptureSteps::Part part, SeriesSink* sink) {
  CaptureSteps steps(problem, detail, progress, part, sink);
  while (steps.next()) steps.move();
  return steps.finish();
}

}  // namespace

CaptureResult simulate_capture(const CaptureProblem& problem, const CaptureProgress& progress, CaptureDetail detail,
                               SeriesSink* sink) {
  return simulate(problem, detail, progress, CaptureSteps::Part::whole, sink);
}

CaptureResult simulate_impact_only(const CaptureProblem& problem, CaptureDetail detail,
                                   const CaptureProgress& progress) {
  return simulate(problem, detail, progress, CaptureSteps::Part::impact_only, nullptr);
}

}  // namespace grapnel
