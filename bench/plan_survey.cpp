/// Plans with many constraints along the approach, one line of CSV each: the problem, the objective and how
/// long it takes. With the lines of another build as argument, what has changed against them.
///
///   build/release/bin/plan_survey > now.csv
///   build/release/bin/plan_survey before.csv > now.csv

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <map>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "grapnel/approach/approach_plan.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/scenario/scenario.hpp"

namespace grapnel {
namespace {

struct Answer {
  bool found = false;
  double objective = 0, seconds = 0;  // CPU time
};

class Survey {
 public:
  explicit Survey(std::map<std::string, Answer> before) : before_(std::move(before)) {
    std::printf("demand,found,objective,seconds\n");
  }

  void ask(const std::string& demand, const CaptureProblem& problem) {
    const std::clock_t begin = std::clock();
    const ApproachPlan plan = plan_approach(problem, plan_targets(problem));
    const Answer now{plan.failure.empty(), plan.report.objective_value,
                     static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC};
    std::printf("%s,%d,%.10g,%.4f\n", demand.c_str(), now.found, now.objective, now.seconds);
    std::fflush(stdout);
    compare(demand, now);
  }

  void conclude() const {
    if (before_.empty()) return;
    for (const auto& [what, count] : counts_) std::fprintf(stderr, "%s: %d\n", what.c_str(), count);
    std::fprintf(stderr, "%.1f s, before %.1f s; the longest %.2f s, before %.2f s; the longest refusal %.2f s\n", all_,
                 all_before_, longest_, longest_before_, longest_refusal_);
  }

 private:
  void compare(const std::string& demand, const Answer& now) {
    constexpr double kSame = 1e-4;
    const auto known = before_.find(demand);
    if (known == before_.end()) return;
    const Answer& before = known->second;
    all_ += now.seconds, all_before_ += before.seconds;
    longest_ = std::max(longest_, now.seconds), longest_before_ = std::max(longest_before_, before.seconds);
    if (!now.found) longest_refusal_ = std::max(longest_refusal_, now.seconds);
    std::string what = now.found ? "newly planned" : before.found ? "newly refused" : "refused by both";
    if (now.found && before.found) {
      const double more = now.objective - before.objective, size = std::max(1e-9, std::abs(before.objective));
      what = std::abs(more) <= kSame * size ? "same objective" : more < 0 ? "less" : "more";
      if (what == "more") std::fprintf(stderr, "more by %.2g %%: %s\n", 100 * more / size, demand.c_str());
    }
    if (what == "newly refused") std::fprintf(stderr, "newly refused: %s\n", demand.c_str());
    ++counts_[what];
  }

  std::map<std::string, Answer> before_;
  std::map<std::string, int> counts_;
  double all_ = 0, all_before_ = 0, longest_ = 0, longest_before_ = 0, longest_refusal_ = 0;
};

CaptureProblem load(const char* scenario) {
  CaptureProblem p = load_scenario(std::string(GRAPNEL_SOURCE_DIR "/scenarios/") + scenario + ".yaml");
  p.approach->straight_in.reset();
  PlanSetup& plan = *p.approach->plan;
  plan.limits = PlanSetup::Limits::at_end;
  plan.clearance.reset(), plan.base_turn.reset(), plan.weights.reset();
  plan.objective = ObjectiveKind::excursion;
  return p;
}

// Limits in steps from what the plan without them has to beyond what can be kept.
void ask_limits(Survey& survey, const std::string& name, const CaptureProblem& free) {
  constexpr double kNoRate = 1e3, kNoEffort = 1e5;  // limits that limit nothing
  for (const char* kind : {"rate", "effort", "position", "clearance", "turn"}) {
    const std::string of = kind;
    CaptureProblem loose = free;
    loose.approach->plan->knots = 0;
    loose.approach->plan->limits = PlanSetup::Limits::on_the_way;
    for (BodyDescription& b : loose.robot.bodies) b.joint.limits.rate = kNoRate, b.joint.limits.effort = kNoEffort;
    if (of == "clearance") loose.approach->plan->clearance = 1e-4;
    if (of == "turn") loose.approach->plan->base_turn = 3;
    const ApproachPlan plan = plan_approach(loose, plan_targets(loose));
    if (!plan.failure.empty() || !plan.report.way) continue;
    const auto& way = *plan.report.way;
    for (const double level : {0.95, 0.8, 0.65, 0.5, 0.35}) {
      CaptureProblem p = free;
      PlanSetup& setup = *p.approach->plan;
      setup.limits = PlanSetup::Limits::on_the_way;
      for (BodyDescription& b : p.robot.bodies) {
        if (of == "rate") b.joint.limits.rate = kNoRate * way.rate_share.value_or(1) * level;
        if (of == "effort") b.joint.limits.effort = kNoEffort * way.effort_share.value_or(1) * level;
        if (of == "position") b.joint.limits.lower *= level, b.joint.limits.upper *= level;
      }
      if (of == "clearance" && !way.clearance) continue;
      if (of == "clearance") setup.clearance = *way.clearance + 0.15 * (1 - level);
      if (of == "turn") setup.base_turn = std::max(1e-3, way.base_turn * level);
      char at[16];
      std::snprintf(at, sizeof at, "%.2f", level);
      survey.ask(name + " " + of + " " + at, p);
    }
  }
}

void ask_objectives(Survey& survey, const std::string& name, const CaptureProblem& free) {
  using Kind = ObjectiveKind;
  const std::pair<const char*, Kind> kinds[] = {
      {"effort", Kind::effort},           {"base_attitude", Kind::base_attitude},
      {"base_motion", Kind::base_motion}, {"clearance", Kind::clearance},
      {"impulse", Kind::impulse},         {"impulse_index", Kind::impulse_index},
      {"limits", Kind::limits},           {"manipulability", Kind::manipulability}};
  for (const auto& [kind, objective] : kinds) {
    for (const bool limited : {false, true}) {
      CaptureProblem p = free;
      p.approach->plan->objective = objective;
      if (limited) p.approach->plan->limits = PlanSetup::Limits::on_the_way, p.approach->plan->base_turn = 0.2;
      survey.ask(name + " objective " + kind + (limited ? " turn 0.2" : ""), p);
    }
  }
}

// Boxes on the first target, in the way of the first arm; the same numbers everywhere.
void ask_boxes(Survey& survey, const char* scenario, int count) {
  std::mt19937_64 generator(7);
  const auto between = [&](double a, double b) {
    return a + (b - a) * std::ldexp(static_cast<double>(generator() >> 11), -53);
  };
  for (int i = 0; i < count; ++i) {
    CaptureProblem p = load(scenario);
    PlanSetup& plan = *p.approach->plan;
    plan.clearance = 0.01, plan.near_grasp = 0.4, plan.knots.reset();
    const GraspSetup& grasp = p.grasps[0];
    const Posed X_WT = plan_targets(p).capture[0].X_WT;
    const Vector3d way = X_WT * grasp_point_of(p, grasp).X_TG.p - p.X_WB.p;
    const Vector3d z = (1 / norm(way)) * way, other = std::abs(z[2]) < 0.9 ? Vector3d{0, 0, 1} : Vector3d{1, 0, 0};
    Vector3d x = cross(other, z);
    x = (1 / norm(x)) * x;
    const Vector3d y = cross(z, x);
    const double side = between(0.1, 0.4), along = between(0.5, 0.9), right = between(-0.3, 0.3),
                 up = between(-0.15, 0.15);
    Geometry box{Geometry::Shape::box, {side, side, between(0.15, 0.3)}};
    const Rotationd R{{{x[0], y[0], z[0]}, {x[1], y[1], z[1]}, {x[2], y[2], z[2]}}};
    box.X_BG = inverse(X_WT) * Posed{R, p.X_WB.p + along * way + right * x + up * y};
    p.targets[0].geometry.push_back(box);
    survey.ask(std::string(scenario) + " box " + std::to_string(i), p);
  }
}

std::map<std::string, Answer> read(const char* path) {
  std::map<std::string, Answer> answers;
  std::ifstream file(path);
  if (!file) throw std::runtime_error(std::string("cannot read ") + path);
  std::string line, part[4];
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream parts(line);
    for (std::string& each : part) std::getline(parts, each, ',');
    answers[part[0]] = {part[1] == "1", std::strtod(part[2].c_str(), nullptr), std::strtod(part[3].c_str(), nullptr)};
  }
  return answers;
}

void run(int argc, char** argv) {
  Survey survey(argc > 1 ? read(argv[1]) : std::map<std::string, Answer>{});
  for (const char* scenario : {"first-plan", "dual-arm-tumbling-targets", "dual-arm-satellite-handles",
                               "heavy-satellite-flat-spin", "triple-arm-satellite"}) {
    for (const bool splines : {false, true}) {
      CaptureProblem p = load(scenario);
      if (splines)
        p.approach->plan->knots.reset();
      else
        p.approach->plan->knots = 0;
      const std::string name = std::string(scenario) + (splines ? " splines" : "");
      ask_limits(survey, name, p);
      ask_objectives(survey, name, p);
    }
  }
  ask_boxes(survey, "first-plan", 100), ask_boxes(survey, "dual-arm-tumbling-targets", 30);
  survey.conclude();
}

}  // namespace
}  // namespace grapnel

int main(int argc, char** argv) {
  try {
    grapnel::run(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "plan_survey: %s\n", e.what());
    return 1;
  }
}
