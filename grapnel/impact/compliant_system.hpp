#pragma once

/// @file
/// The differential equations of a compliant impact (docs/theory, section 12) of one model: their tables, single
/// points in doubles, many points in packs.

#include <memory>
#include <optional>

#include "grapnel/constraint/constrained_dynamics.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/impact/compliant_impact.hpp"
#include "grapnel/impact/compliant_kernel.hpp"
#include "grapnel/impact/compliant_shapes.hpp"
#include "grapnel/spatial/dispatch.hpp"

namespace grapnel {

/// Maximum deformation of a lossless central impact at `speed` with the effective `mass` of the bodies, (12.15).
double largest_deformation(const CompliantContact& contact, double mass, double speed);

/// Integrated numbers y: deviations of coordinates from the start (compliant_kernel::Displacements), for trees moved by
/// their centres of mass from free uniform motion; deviations of velocities that are neither held nor follow from
/// momentum; per interface (contacts, then grasps) the impulse about its point at the start; per interface the energy
/// lost; per held velocity its impulse; the work of held velocities; with a drive its work; with springs at joints
/// (JointDescription::spring) the energy dissipated by their dampers. All zero at the start.
///
/// With loop closures, after the impulses of interfaces, per closure: the impulse on its body a about channel_point().
///
/// From the first contact between shapes on (begin_shapes()), after these: per pair of trees that
/// shapes may push the impulse exchanged (ImpulseChannel); the deformations of the pairs in contact with friction. At
/// the end: per group of shapes ContactIntegrals.
class CompliantSystem {
 public:
  /// `set`: of the packs in which several points are evaluated simultaneously; none: doubles, sequentially, as always
  /// for models with joints that move by modes, and with loops.
  CompliantSystem(const Model& model, const State& state, std::span<const CompliantContact> contacts,
                  std::span<const CompliantGrasp> grasps, std::span<const int> held, ImpactDrive* drive = nullptr,
                  std::optional<lanes::InstructionSet> set = lanes::best_instruction_set(),
                  std::span<const LoopClosure> loops = {});
  CompliantSystem(const CompliantSystem&) = delete;
  CompliantSystem& operator=(const CompliantSystem&) = delete;

  int size() const { return tables_.size; }
  int interfaces() const { return tables_.interface_count(); }
  int contact_count() const { return tables_.contact_count; }
  int grasp_count() const { return tables_.grasp_count; }
  bool in_packs() const { return packs_ != nullptr; }

  /// Offsets in y.
  int rate_offset() const { return tables_.rate_at; }
  int impulse_offset(int interface) const { return tables_.impulse_at + 6 * interface; }
  const Vector3d& channel_point() const { return tables_.channel_point; }
  int loop_offset(int loop) const { return tables_.channel_at + 6 * loop; }
  int loss_offset(int interface) const { return tables_.loss_at + interface; }
  int held_offset(int held) const { return tables_.held_at + held; }
  int work_offset() const { return tables_.work_at; }
  int drive_offset() const { return tables_.drive_at(); }    // of the drive's work, with one
  int spring_offset() const { return tables_.spring_at(); }  // of the energy dissipated by dampers at sprung joints
  int shape_offset() const { return shape_at_; }             // of the integrals of shapes
  /// Velocities (indices into State::v) in y, in order.
  std::span<const int> integrated_rates() const { return rates_; }
  bool is_held(int velocity) const { return prescribed_[velocity] != 0; }

  /// Reads the state from y and evaluates all interfaces; see now() and loads().
  void load(double t, std::span<const double> y);
  const State& now() const { return now_; }
  std::span<const InterfaceLoad> loads() const { return kernel_->loads(); }
  /// Wrenches of contacts, grasps and shapes on their bodies.
  std::span<const ExternalWrench> wrenches_now() { return wrenches(loads()); }
  double kinetic_energy_now() const;
  /// Of the trees that an interface or a held velocity acts on [J].
  double kinetic_energy_taking_part_now() const;
  /// Of the springs at their joints [J].
  double spring_energy_now() const;
  bool has_springs() const { return !springs_.empty(); }

  // Loop closures, which hold exactly and do no work:

  std::span<const LoopClosure> loops() const { return loops_; }
  /// Grasps that hold as the closures do, at a state.
  std::vector<Grasp> closed_grasps(const Kinematics& kinematics) const;
  /// The row with which held velocities contradicted the closures at the last evaluation of rates; empty: none.
  std::string contradiction() const;

  /// Right-hand side. Never throws.
  void rates(double t, std::span<const double> y, std::span<double> dydt);
  /// For many points: as many y's in sequence as times; likewise the results. `loads`: of interfaces at each point, as
  /// many as interfaces; or empty. Never throws.
  void rates(std::span<const double> t, std::span<const double> y, std::span<double> dydt,
             std::span<InterfaceLoad> loads);
  /// Loads of interfaces at many points.
  void evaluate_loads(std::span<const double> t, std::span<const double> y, std::span<InterfaceLoad> loads);
  /// States, interfaces and rates of all velocities (per State::v; held ones zero) at many points.
  struct Sampled {
    std::vector<double> q, v, acceleration;
    std::vector<InterfaceLoad> loads;
    std::vector<ShapeSample> shapes;               // with attached shapes
    std::vector<std::vector<double>> multipliers;  // with loops: LoopSolver::multipliers()
  };
  void sample(std::span<const double> t, std::span<const double> y, Sampled& at);

  // Contacts between shapes:

  /// Attaches them: they are watched, and act once begin_shapes() has been called. `shapes` outlives this object.
  void attach(ImpactShapes& shapes) { shapes_.emplace(model_, shapes, tables_.channel_point); }
  bool has_shapes() const { return shapes_.has_value(); }
  /// Whether they act.
  bool shapes_act() const { return shapes_act_; }
  ShapeForces& shapes() { return *shapes_; }
  /// Lets attached shapes act from now on: their trees take part, and y gets their numbers.
  void begin_shapes();
  /// y before begin_shapes() => y afterwards.
  std::vector<double> with_shape_numbers(std::span<const double> y) const;
  /// Impacts in an instant of the hard pairs that touch at this point; y is the one after them.
  void strike(double t, std::vector<double>& y);
  /// y, whose state is now() => the modes of all pairs there, and y in the new layout.
  std::vector<double> choose_shape_modes(double t, std::span<const double> y);
  /// Numbers for the y without shapes => for the present layout, with these values for the additional numbers.
  struct ShapeNumbers {
    double moment, impulse, stick, integral;
  };
  std::vector<double> arranged(std::span<const double> numbers, const ShapeNumbers& added) const;
  /// ContactSet::begin_step() and end_step() at a point.
  void begin_shape_step(double t, std::span<const double> y);
  bool end_shape_step(double t, std::span<const double> y, double duration);
  /// Impulse of fixed surfaces so far, about W's origin.
  Momentumd from_fixed(std::span<const double> y) const;

  /// Two event functions per contact, whose meaning depends on its phase, then the margin of attached shapes; and their
  /// directions of interest (-1, 1).
  int events() const { return 2 * contact_count() + (shapes_ ? 1 : 0); }
  /// Without the margin of shapes.
  void event_values(std::span<const InterfaceLoad> loads, std::span<double> g) const;
  void event_values(double t, std::span<const double> y, std::span<double> g);
  void event_directions(std::span<int> directions) const;
  /// The phase of a contact with `load` after event function `which` (0 or 1) has crossed zero.
  ContactPhase phase_after(int contact, int which, const InterfaceLoad& load) const;

  std::vector<ContactPhase> phase;  // per contact; may be changed by the caller between steps

 private:
  void describe_bodies(const Vector3d& origin_W);
  void describe_trees();
  void describe_interfaces(std::span<const CompliantContact> contacts, std::span<const CompliantGrasp> grasps,
                           const Vector3d& origin_W);
  void describe_loops(std::span<const LoopClosure> loops);
  void describe_springs();
  void lay_out();
  void close_accelerations();
  void add_loop_rates(double* dydt);
  void place(double t, std::span<const double> y);
  void load_shapes(const double* y, State& state);
  void add_shape_rates(double* dydt);
  void add_shape_impulse(int body_a, int body_b, const Vector3d& p_WC, const Wrenchd& on_b, double* y) const;
  int channel_of(int tree_a, int tree_b) const;
  InterfaceSide side(int body) const;
  bool takes_part(int body) const;
  std::span<const ExternalWrench> wrenches(std::span<const InterfaceLoad> loads);
  void evaluate(CompliantPoints points);
  void evaluate_here(const CompliantPoints& points);
  void drive_efforts(double t, const double* q, const double* v, const InterfaceLoad* loads, double* effort);

  const Model& model_;
  ImpactDrive* drive_;
  State start_, now_;
  std::vector<int> held_, quaternions_;
  std::vector<int> taking_part_;  // roots of the trees that an interface or a held velocity acts on
  std::vector<std::uint8_t> prescribed_;
  std::vector<int> rates_;
  std::vector<StartBody> bodies_;
  std::vector<StartTree> trees_;
  std::vector<InterfaceTable> interfaces_;
  std::vector<SpringTable> springs_;
  std::optional<ShapeForces> shapes_;
  bool shapes_act_ = false;
  std::vector<ImpulseChannel> channels_;
  std::vector<int> tree_of_;  // per body; -1: none
  int stick_at_ = 0, shape_at_ = 0;
  std::vector<LoopClosure> loops_;
  std::optional<LoopSolver> loop_solver_;
  std::optional<Workspace> loop_workspace_;
  std::vector<double> loop_vdot_, loop_force_;
  // Receive those of the points being evaluated:
  std::vector<ShapeSample>* shape_samples_ = nullptr;
  std::vector<std::vector<double>>* multipliers_ = nullptr;
  CompliantTables tables_{};
  std::optional<CompliantKernel<double>> kernel_;
  std::unique_ptr<CompliantPacks> packs_;
  std::vector<ExternalWrench> wrenches_;
  std::vector<double> effort_, point_q_, point_v_;
  std::vector<InterfaceLoad> point_loads_;
  State drive_state_, point_state_;
};

}  // namespace grapnel
