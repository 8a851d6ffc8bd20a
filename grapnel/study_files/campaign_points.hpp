#pragma once

/// @file
/// The cases of a campaign, from trees.

#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>

#include "grapnel/campaign/sample_points.hpp"
#include "grapnel/scenario/problem_setter.hpp"
#include "grapnel/study_files/axis.hpp"
#include "grapnel/study_files/read_uncertain.hpp"

namespace grapnel {

/// The scenario at a point of the design: with the campaign's `set`, the design's values and, if it is planned
/// beforehand, the plan, but its uncertain values as they stand.
struct DesignPoint {
  std::filesystem::path file;    // under which ScenarioFiles has it; no file on disk
  Node filled;                   // its tree, with the schema's defaults, and with the robot where a path leads into it
  std::vector<Change> of_robot;  // to be made in every case, of a robot whose import is uncertain
  CaptureProblem problem;
  std::vector<UncertainForm> forms;    // per uncertain value
  std::vector<ProblemSetter> setters;  // per path of the uncertain values, in their order; empty: by reading
  std::uint64_t number = 0;
};

/// Thread safety: the members are set up by one thread; then the functions may be called from any.
class CampaignPoints {
 public:
  std::filesystem::path scenario;
  std::vector<Change> set;
  std::vector<ReadAxis> axes;            // of the design
  std::vector<UncertainPaths> paths;     // of the uncertain values
  std::vector<ReadUncertain> uncertain;  // likewise; empty until they are read
  std::vector<std::size_t> counts;       // numbers at the places of each, at the design's first point; empty as above
  bool plan_once = true;
  std::uint64_t cases = 1;  // per point of the design
  std::optional<SamplePoints> samples;
  ScenarioFiles files;

  /// The scenario at a position of the design before quantities are applied; `warnings` as of load_scenario().
  /// @throws InputError
  CaptureProblem before_quantities(std::span<const std::size_t> at, std::vector<Fault>* warnings = nullptr);
  /// A point of the design by its number. @throws std::exception if its scenario is faulty or cannot be planned.
  std::shared_ptr<const DesignPoint> design_point(std::uint64_t number);

  /// Numbers of the uncertain values at a point of the unit cube: what goes into the scenario and what tables show.
  struct Draw {
    std::vector<DrawnValue> values;
  };
  Draw draw(const DesignPoint& design, std::span<const double> point) const;
  /// A problem by reading the scenario with these values, or by the setters where there are any and they can.
  CaptureProblem read(const DesignPoint& design, const Draw& draw);
  CaptureProblem problem(const DesignPoint& design, const Draw& draw);

  /// Of case k.
  std::vector<double> inputs(std::uint64_t k);
  StudyCase study_case(std::uint64_t k);
  std::string scenario_text(std::uint64_t k, const std::filesystem::path& place, const std::string& comment);

  /// Points of the design are made anew: after the members were changed.
  void forget();
  /// From now on all values are read, none is set.
  void read_instead() { setters_allowed_ = false, forget(); }

 private:
  void expect_counts(const DesignPoint& design) const;
  std::shared_ptr<const DesignPoint> make(std::uint64_t number);
  std::vector<Change> changes(const DesignPoint& design, const Draw& draw) const;
  std::vector<std::size_t> axis_sizes() const;
  std::vector<double> point_of(std::uint64_t k) const;

  bool setters_allowed_ = true;
  std::mutex mutex_;
  // A point, or why there is none.
  struct KeptPoint {
    std::shared_ptr<const DesignPoint> point;
    std::exception_ptr trouble;
    std::shared_ptr<const DesignPoint> get() const {
      if (trouble) std::rethrow_exception(trouble);
      return point;
    }
  };
  std::map<std::uint64_t, KeptPoint> kept_;  // guarded by mutex_, as order_
  std::deque<std::uint64_t> order_;
};

}  // namespace grapnel
