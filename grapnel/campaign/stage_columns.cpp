// Columns of the stages of captures by contacts.
#include <fmt/format.h>

#include <cmath>

#include "grapnel/campaign/column.hpp"
#include "grapnel/problem/stage_pairs.hpp"
#include "grapnel/result/result_documents.hpp"

namespace grapnel {
namespace {

// Value of the report of one target; NaN: the run ended before stages were reported.
template <class Value>
auto of_target(const std::string& target, Value value) {
  return [target, value](const StudyCase&, const CaptureResult& r) {
    for (const StagesReport& report : r.stages) {
      if (report.target == target) return static_cast<double>(value(report));
    }
    return double(NAN);
  };
}

}  // namespace

std::vector<Column> stage_columns(const CaptureProblem& problem) {
  using Stage = StagesReport::Stage;
  using Failure = StagesReport::Failure;
  std::vector<Column> columns;
  for (const StagesSetup& setup : problem.stages) {
    const std::string target = problem.targets[stage_target(problem, setup)].name, path = "stages/" + target + "/";
    const auto add = [&](const std::string& key, const char* unit, const std::string& text, auto value) {
      columns.push_back({path + key, unit, text, of_target(target, value)});
    };
    for (const Choice& choice : type_of<Stage>().choices) {
      const auto stage = static_cast<Stage>(choice.value);
      if (stage == Stage::approach) continue;
      add(std::string(choice.name), "1",
          fmt::format("whether the stage `{}` was reached: its mean is the probability", choice.name),
          [stage](const auto& s) { return stage_time(s, stage).has_value(); });
    }
    for (const Choice& choice : type_of<Failure>().choices) {
      const auto failure = static_cast<Failure>(choice.value);
      if (failure == Failure::none) continue;
      add(std::string(choice.name), "1", fmt::format("whether the capture failed by `{}`", choice.name),
          [failure](const auto& s) { return s.failure == failure; });
    }
    for (const char* key :
         {"contact_time", "closed_time", "settled_time", "latched_time", "grip_force", "least_friction_margin"}) {
      const Field& field = *field_named(type_of<StagesReport>(), key);
      add(key, std::string(field.unit).c_str(), std::string(field.text),
          [&field](const StagesReport& s) { return number_in(field, &s, 0); });
    }
  }
  return columns;
}

}  // namespace grapnel
