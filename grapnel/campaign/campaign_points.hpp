#pragma once

/// @file
/// The cases of a campaign, from trees.

#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>

#include "grapnel/campaign/axis.hpp"
#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/read_uncertain.hpp"
#include "grapnel/campaign/sample_points.hpp"
#include "grapnel/scenario/problem_setter.hpp"

namespace grapnel {

/// The scenario at a point of the design: with the campaign's `set`, the design's values and, with plan: nominal, the
/// plan, but with nominal uncertain values.
struct DesignPoint {
  std::filesystem::path file;    // its key in ScenarioFiles; not a file on disk
  Node filled;                   // its tree, with the schema's defaults, and with the robot if a path leads into it
  std::vector<Change> of_robot;  // applied in every case, for a robot with uncertain import options
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
  std::vector<ReadUncertain> uncertain;  // the uncertain values; empty until they are read
  std::vector<std::size_t>
      counts;  // numbers at the places of each, at the design's first point; empty until they are read
  bool plan_once = true;
  std::uint64_t cases = 1;  // per point of the design
  std::optional<SamplePoints> samples;
  ScenarioFiles files;

  /// The scenario at a position of the design before quantities are applied; `warnings` as of load_scenario().
  /// @throws InputError
  CaptureProblem before_quantities(std::span<const std::size_t> at, std::vector<Fault>* warnings = nullptr);
  /// A point of the design by its number. @throws std::exception if its scenario has errors or cannot be planned.
  std::shared_ptr<const DesignPoint> design_point(std::uint64_t number);

  /// Numbers of the uncertain values at a point of the unit cube: values for the scenario and for tables.
  struct Draw {
    std::vector<DrawnValue> values;
  };
  Draw draw(const DesignPoint& design, std::span<const double> point) const;
  /// A problem with these values, by the setters if they support all of them, else by reading the scenario.
  CaptureProblem read(const DesignPoint& design, const Draw& draw);
  CaptureProblem problem(const DesignPoint& design, const Draw& draw);

  /// Of case k.
  std::vector<double> inputs(std::uint64_t k);
  StudyCase study_case(std::uint64_t k);
  std::string scenario_text(std::uint64_t k, const std::filesystem::path& place, const std::string& comment);

  /// Discards cached points of the design: call after changes of the members.
  void forget();
  /// Disables the setters: all values are read from now on.
  void read_instead() { setters_allowed_ = false, forget(); }

 private:
  void expect_counts(const DesignPoint& design) const;
  std::shared_ptr<const DesignPoint> make(std::uint64_t number);
  std::vector<Change> changes(const DesignPoint& design, const Draw& draw) const;
  std::vector<std::size_t> axis_sizes() const;
  std::vector<double> point_of(std::uint64_t k) const;

  bool setters_allowed_ = true;
  std::mutex mutex_;
  // A point, or the reason for its absence.
  struct StoredPoint {
    std::shared_ptr<const DesignPoint> point;
    std::exception_ptr error;
    std::shared_ptr<const DesignPoint> get() const {
      if (error) std::rethrow_exception(error);
      return point;
    }
  };
  std::map<std::uint64_t, StoredPoint> stored_;  // guarded by mutex_, as order_
  std::deque<std::uint64_t> order_;
};

/// A campaign from a file with its points, for evaluations at other values than drawn ones. @throws as load_campaign()
struct CampaignWithPoints {
  Campaign campaign;
  std::shared_ptr<CampaignPoints> points;
};
CampaignWithPoints load_campaign_with_points(const std::filesystem::path& path, std::vector<Fault>* warnings = nullptr);

}  // namespace grapnel
