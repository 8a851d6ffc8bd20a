#pragma once

/// @file
/// Quantities of a log in terms of a run's model: which generalized velocities and coordinates they measure, and with
/// which uncertainty.

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "grapnel/compare/compare_log.hpp"
#include "grapnel/compare/run_model.hpp"
#include "grapnel/dynamics/kinematics.hpp"

namespace grapnel {

/// One quantity of a log, and what it measures.
struct MeasuredQuantity {
  enum class Kind { twist, joint_rate, position, joint_position, orientation, effort, grasp_force };
  const ComparedQuantity* quantity = nullptr;
  Kind kind = Kind::twist;
  bool is_angular = false;           // of a twist: angular velocity; of a grasp force: moment
  PlacedFrame place;                 // of twists, positions and orientations
  std::vector<int> joints;           // bodies, of joint quantities
  std::vector<std::size_t> parts;    // x, y, z of vectors: all three or one
  std::optional<PlacedFrame> frame;  // whose axes the log uses; empty: W
  std::string end_effector;          // of grasp forces

  bool measures_rates() const { return kind == Kind::twist || kind == Kind::joint_rate; }
  bool measures_places() const {
    return kind == Kind::position || kind == Kind::joint_position || kind == Kind::orientation;
  }
  std::size_t width() const { return kind == Kind::orientation ? 3 : quantity->curve.width(); }
};

struct MeasuredQuantities {
  std::vector<MeasuredQuantity> used;
  std::vector<std::string> unused;  // "NAME: reason"
};
/// The quantities of a log that say something about the motion. Those without an uncertainty are unused.
MeasuredQuantities measured_quantities(std::span<const ComparedQuantity> quantities, const RunModel& run);

/// The rows of a quantity over the generalized velocities: its rate is the product. Rates of orientations are along the
/// body's axes.
Eigen::MatrixXd rate_rows(const MeasuredQuantity& one, const Model& model, const Kinematics& kinematics);
/// The log's axes in W.
Rotationd log_axes(const MeasuredQuantity& one, const Kinematics& kinematics);

/// An interval of contact in the run's time. Equal times: an instant.
struct ContactTime {
  double begin = 0, end = 0;  // [s]
  double deviation = 0;       // standard uncertainty of an instant [s]
};

/// Samples that may be used around a contact: between its neighbours.
struct FitRange {
  double from, to;               // [s]
  std::optional<double> window;  // on either side [s]; empty: chosen
};

/// The change of one quantity's rate, and its place, at a contact. Per component.
struct MeasuredChange {
  Eigen::VectorXd before, after;           // rates; of places: slopes
  Eigen::VectorXd change;                  // of the rate
  Eigen::VectorXd deviation;               // standard uncertainty of `change`, with `curvature`
  Eigen::VectorXd curvature;               // estimated error of the polynomials, from the run
  Eigen::VectorXd per_delay;               // error of `change` per second that the contact is later than stated
  Eigen::VectorXd place, place_deviation;  // of places: at the contact; of orientations: rotation vector
  Quaterniond reference = Quaterniond::identity();  // of orientations, in the log's frame
  double window = 0;                                // on either side [s]
  std::size_t samples = 0, outliers = 0;
  double chi_square = 0;  // per degree of freedom, of the samples about the polynomials
  int freedom = 0;
};

/// Fits polynomials to the samples before and after a contact. The window is that with the smallest total of noise and
/// curvature; the curvature is the error of the same fit to the run around its contact, whose change of the rate is
/// `run_change`. Empty if there are too few samples.
std::optional<MeasuredChange> measure_change(const MeasuredQuantity& one, double offset, const ContactTime& contact,
                                             const ContactTime& run_contact, const Eigen::VectorXd& run_change,
                                             const FitRange& range);

/// A configuration of all bodies: measured coordinates, and for others those of the run.
class MeasuredConfiguration {
 public:
  MeasuredConfiguration(const RunModel& run, State state) : run_(run), state_(std::move(state)) {}

  /// Sets measured places. `deviation`: of each component.
  void set(const MeasuredQuantity& one, const Eigen::VectorXd& place, const Eigen::VectorXd& deviation,
           const Quaterniond& reference);
  /// Places the targets that are not measured relative to the end-effectors that grasp them, as in the run.
  void attach(std::span<const RunContact::Grasp> grasps);

  std::size_t parameters() const { return parameters_.size(); }
  /// With each parameter changed by this many standard uncertainties.
  State at(std::span<const double> changes) const;
  /// The places that are not measured: "base attitude", "joint NAME", "position of target NAME".
  std::vector<std::string> unmeasured() const;

 private:
  struct Parameter {
    enum class Kind { joint, position, rotation } kind;
    int body;
    Vector3d axis;  // of positions in W, of rotations in the body
    double deviation;
  };
  struct Placed {
    int body;
    Vector3d p_BF;  // of the frame whose position is measured
  };
  struct Attached {
    int target;
    PlacedFrame end_effector;
    Posed X_ET;
  };
  // The point of a body about which measured orientations turn it: the measured one, else the body's origin.
  Vector3d pivot_of(int body) const;

  const RunModel& run_;
  State state_;
  std::vector<Parameter> parameters_;
  std::vector<Attached> attached_;
  std::vector<Placed> pivots_;                 // the last measured position of each body, also of one component
  std::vector<int> placed_, turned_, joints_;  // bodies with a measured position, orientation, joint value
};

}  // namespace grapnel
