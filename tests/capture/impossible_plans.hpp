#pragma once

/// @file
/// Approaches that nobody can plan, made of scenarios that are shipped: what tests and benchmarks ask how planning
/// answers.

#include <functional>
#include <string>
#include <vector>

#include "grapnel/scenario/scenario.hpp"

namespace grapnel::testing {

struct ImpossiblePlan {
  std::string name;
  std::string scenario;  // in scenarios/, without .yaml
  std::function<void(CaptureProblem&)> ask;
  std::string reason;  // part of the answer

  CaptureProblem problem() const {
    CaptureProblem p = load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/" + scenario + ".yaml");
    ask(p);
    return p;
  }
};

inline PlanSetup& on_the_way(CaptureProblem& p) {
  PlanSetup& plan = *p.approach->plan;
  plan.limits = PlanSetup::Limits::on_the_way;
  plan.knots = 0;
  return plan;
}

/// Arms of seven joints, two, two at one target, three, six, and one.
inline std::vector<ImpossiblePlan> impossible_plans() {
  using Ask = std::function<void(CaptureProblem&)>;
  const auto rates = [](double limit) -> Ask {
    return [limit](CaptureProblem& p) {
      on_the_way(p);
      for (BodyDescription& body : p.robot.bodies) body.joint.limits.rate = limit;
    };
  };
  const auto efforts = [](double limit) -> Ask {
    return [limit](CaptureProblem& p) {
      on_the_way(p);
      for (BodyDescription& body : p.robot.bodies) body.joint.limits.effort = limit;
    };
  };
  const auto positions = [](double share) -> Ask {
    return [share](CaptureProblem& p) {
      on_the_way(p);
      for (BodyDescription& body : p.robot.bodies) body.joint.limits.lower *= share, body.joint.limits.upper *= share;
    };
  };
  // The piece straight in so short, or so fast in the end, that joints' rates do not do; the way there keeps what it
  // is.
  const auto in_short = [](double duration) -> Ask {
    return [duration](CaptureProblem& p) {
      on_the_way(p);
      p.approach->duration += duration - p.approach->straight_in->duration;
      p.approach->straight_in->duration = duration;
    };
  };
  const auto in_fast = [](double speed) -> Ask {
    return [speed](CaptureProblem& p) { on_the_way(p), p.approach->straight_in->final_speed = speed; };
  };
  const auto clearance = [](double distance) -> Ask {
    return [distance](CaptureProblem& p) { on_the_way(p).clearance = distance; };
  };
  const auto turn = [](double angle) -> Ask { return [angle](CaptureProblem& p) { on_the_way(p).base_turn = angle; }; };
  const auto away = [](double distance) -> Ask {
    return [distance](CaptureProblem& p) { p.targets[0].X_WT.p += Vector3d{distance, 0, 0}; };
  };
  const char *two = "dual-arm-tumbling-targets", *both = "dual-arm-satellite-handles", *three = "triple-arm-satellite",
             *six = "six-arm-servicer", *one = "heavy-satellite-flat-spin", *planar = "first-plan";
  return {
      {"straight-in-short/two-arms", two, in_short(2), "exceeds its rate limit"},
      {"straight-in-short/three-arms", three, in_short(2), "exceeds its rate limit"},
      {"straight-in-short/six-arms", six, in_short(2), "exceeds its rate limit"},
      {"straight-in-short/one-arm", one, in_short(2), "exceeds its rate limit"},
      {"straight-in-fast/two-arms", two, in_fast(0.2), "exceeds its rate limit"},
      {"straight-in-fast/both-arms", both, in_fast(0.2), "exceeds its rate limit"},
      {"straight-in-fast/three-arms", three, in_fast(0.25), "exceeds its rate limit"},
      {"straight-in-fast/six-arms", six, in_fast(0.2), "exceeds its rate limit"},
      {"straight-in-nearly/two-arms", two, in_fast(0.185), "exceeds its rate limit"},
      {"straight-in-nearly/one-arm", one, rates(0.03), "exceeds its rate limit"},
      {"straight-in-positions/three-arms", three, positions(0.65), "beyond its"},
      {"rates/two-arms", two, rates(0.03), "exceeds its rate limit"},
      {"efforts/two-arms", two, efforts(0.1), "exceeds its effort limit"},
      {"positions/two-arms", two, positions(0.55), "beyond its"},
      {"clearance/two-arms", two, clearance(0.5), "0.5 m is to be kept"},
      {"base-turn/two-arms", two, turn(1e-3), "the base turns"},
      {"out-of-reach/two-arms", two, away(5), "comes no closer than"},
      {"out-of-reach/planar", planar, away(3), "comes no closer than"},
  };
}

}  // namespace grapnel::testing
