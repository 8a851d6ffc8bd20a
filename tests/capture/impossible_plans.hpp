#pragma once

/// @file
/// Infeasible approaches, derived from shipped scenarios, for tests and benchmarks of planning failures.

#include <functional>
#include <string>
#include <vector>

#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/approach/capture_window.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/scenario/scenario.hpp"

namespace grapnel::testing {

/// What planning says and how much work it took, with the search for the time of capture where there is a window.
struct PlanAnswer {
  std::string failure;
  bool found;
  double joints;
  long rhs_evaluations;
};
inline PlanAnswer answer(const CaptureProblem& problem) {
  const auto joints = static_cast<double>(make_servicer(problem).model.joints().size());
  if (problem.approach->window) {
    const CaptureTime chosen = choose_capture_time(problem);
    return {chosen.failure, chosen.failure.empty(), joints, chosen.rhs_evaluations};
  }
  const ApproachPlan plan = plan_approach(problem, plan_targets(problem));
  return {plan.failure, plan.report.found, joints, plan.report.rhs_evaluations};
}

struct ImpossiblePlan {
  std::string name;
  std::string scenario;  // in scenarios/, without .yaml
  std::function<void(CaptureProblem&)> ask;
  std::string reason;  // part of the answer
  double work = 0;     // until it comes: as measured, in thousands of evaluations times joints

  CaptureProblem problem() const {
    CaptureProblem p = load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/" + scenario + ".yaml");
    ask(p);
    return p;
  }
};

// A rotation whose third axis is this unit vector.
inline Rotationd frame_with_z(const Vector3d& z) {
  const Vector3d other = std::abs(z[0]) < 0.6 ? Vector3d{1, 0, 0} : Vector3d{0, 1, 0};
  Vector3d x = cross(other, z);
  x = (1 / norm(x)) * x;
  const Vector3d y = cross(z, x);
  return Rotationd{{{x[0], y[0], z[0]}, {x[1], y[1], z[1]}, {x[2], y[2], z[2]}}};
}

inline PlanSetup& on_the_way(CaptureProblem& p) {
  PlanSetup& plan = *p.approach->plan;
  plan.limits = PlanSetup::Limits::on_the_way;
  plan.knots = 0;
  return plan;
}

/// Infeasible constraints: the final straight approach, limits, distances, the base's rotation, obstacles, reach,
/// times. For arms of seven joints, two, two at one target, three, six, and one.
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
  // A final straight approach so short, or so fast at the end, that joint rates do not suffice; the approach before it
  // is unchanged.
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
             *six = "six-arm-servicer", *one = "heavy-satellite-flat-spin", *planar = "first-plan",
             *quiet = "quiet-approach", *window = "tumbling-window";
  const auto with_splines = [](Ask ask) -> Ask {
    return [ask](CaptureProblem& p) { ask(p), p.approach->plan->knots.reset(); };
  };
  const auto without_straight_in = [](Ask ask) -> Ask {
    return [ask](CaptureProblem& p) { p.approach->straight_in.reset(), ask(p); };
  };
  // A wall between the servicer and the first target's grasp point, so wide that no arm gets round it.
  const auto wall = [](double before) -> Ask {
    return [=](CaptureProblem& p) {
      on_the_way(p).clearance = 0.02, p.approach->plan->near_grasp = 0.3;
      const GraspSetup& grasp = p.grasps[0];
      const TargetSetup& target = target_of(p, grasp);
      const TargetMotion at = plan_targets(p).capture[static_cast<std::size_t>(&target - p.targets.data())];
      const Vector3d point = at.X_WT * grasp_point_of(p, grasp).X_TG.p, way = point - p.X_WB.p;
      const Vector3d along = (1 / norm(way)) * way;
      TargetSetup& behind = p.targets[static_cast<std::size_t>(&target - p.targets.data())];
      Geometry plate{Geometry::Shape::box, {6, 6, 0.02}};
      plate.X_BG = inverse(at.X_WT) * Posed{frame_with_z(along), point - before * along};
      behind.geometry.push_back(plate);
    };
  };
  return {
      {"straight-in-short/two-arms", two, in_short(2), "exceeds its rate limit", 193},
      {"straight-in-short/three-arms", three, in_short(2), "exceeds its rate limit", 492},
      {"straight-in-short/six-arms", six, in_short(2), "exceeds its rate limit", 402},
      {"straight-in-short/one-arm", one, in_short(2), "exceeds its rate limit", 71},
      {"straight-in-fast/two-arms", two, in_fast(0.2), "exceeds its rate limit", 205},
      {"straight-in-fast/both-arms", both, in_fast(0.2), "exceeds its rate limit", 308},
      {"straight-in-fast/three-arms", three, in_fast(0.25), "exceeds its rate limit", 229},
      {"straight-in-fast/six-arms", six, in_fast(0.2), "exceeds its rate limit", 459},
      {"straight-in-nearly/two-arms", two, in_fast(0.185), "exceeds its rate limit", 880},
      {"straight-in-nearly/one-arm", one, rates(0.03), "exceeds its rate limit", 622},
      {"straight-in-positions/three-arms", three, positions(0.65), "beyond its", 1365},
      {"rates/two-arms", two, rates(0.03), "exceeds its rate limit", 126},
      {"efforts/two-arms", two, efforts(0.1), "exceeds its effort limit", 87},
      {"positions/two-arms", two, positions(0.55), "beyond its", 208},
      {"clearance/two-arms", two, clearance(0.5), "the minimum is 0.5 m", 382},
      {"base-turn/two-arms", two, turn(1e-3), "the base turns", 170},
      {"out-of-reach/two-arms", two, away(5), "comes no closer than", 308},
      {"out-of-reach/planar", planar, away(3), "comes no closer than", 589},
      {"out-of-reach/six-arms", six, away(5), "comes no closer than", 3195},
      {"positions/six-arms", six, positions(0.3), "at its upper limit", 250},
      {"base-turn/six-arms", six, turn(1e-3), "the base turns", 301},
      {"clearance/six-arms", six, clearance(0.5), "the minimum is 0.5 m", 773},
      {"splines/rates/two-arms", two, with_splines(rates(0.03)), "exceeds its rate limit", 241},
      {"splines/rates/three-arms", three, with_splines(rates(0.03)), "exceeds its rate limit", 448},
      {"splines/rates/six-arms", six, with_splines(rates(0.03)), "exceeds its rate limit", 447},
      {"splines/efforts/two-arms", two, with_splines(efforts(0.1)), "exceeds its effort limit", 254},
      {"splines/clearance/six-arms", six, with_splines(clearance(0.5)), "the minimum is 0.5 m", 775},
      {"splines/base-turn/two-arms", two, with_splines(turn(1e-3)), "the base turns", 380},
      {"splines/base-turn/six-arms", six, without_straight_in(with_splines(turn(1e-3))), "the base turns", 1714},
      {"splines/base-turn/both-arms", quiet, turn(1e-3), "the base turns", 217},
      {"wall/two-arms", two, with_splines(wall(0.5)), "overlap", 1342},
      {"wall/six-arms", six, with_splines(wall(0.5)), "overlap", 791},
      {"wall/one-arm", one, with_splines(wall(0.7)), "overlap", 487},
      {"wall/planar", planar, with_splines(wall(0.5)), "overlap", 563},
      {"window/never-within-reach", window, away(6), "the distance rules out any capture", 0},
      {"window/out-of-reach", window, away(2), "comes no closer than", 6683},
      {"window/rates", window, with_splines(rates(0.01)), "exceeds its rate limit", 1984},
      {"window/positions", window, positions(0.3), "beyond its lower limit", 2406},
      {"window/clearance", window, with_splines(clearance(0.5)), "the minimum is 0.5 m", 2554},
      {"window/base-turn", window, with_splines(turn(1e-3)), "the base turns", 5031},
      {"window/wall", window, with_splines(wall(0.5)), "overlap", 2555},
  };
}

}  // namespace grapnel::testing
