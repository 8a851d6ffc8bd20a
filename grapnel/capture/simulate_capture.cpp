#include "grapnel/capture/simulate_capture.hpp"

namespace grapnel {
namespace {

CaptureResult simulate(const CaptureProblem& problem, CaptureDetail detail, const CaptureProgress& progress,
                       CaptureSteps::Part part) {
  CaptureSteps steps(problem, detail, progress, part);
  while (steps.next()) steps.move();
  return steps.finish();
}

}  // namespace

CaptureResult simulate_capture(const CaptureProblem& problem, const CaptureProgress& progress, CaptureDetail detail) {
  return simulate(problem, detail, progress, CaptureSteps::Part::whole);
}

CaptureResult simulate_impact_only(const CaptureProblem& problem, CaptureDetail detail,
                                   const CaptureProgress& progress) {
  return simulate(problem, detail, progress, CaptureSteps::Part::impact_only);
}

}  // namespace grapnel
