#pragma once

/// @file
/// The immutable description of a mechanical system: a forest of rigid bodies on joints, with named frames.
///
/// A servicer is a tree whose root is its base; a free target is a tree with one body. ModelBuilder builds and
/// validates a model once; it never changes. A capture creates a new model in which the arm carries the target. Thread
/// safety: a Model is immutable and may be read from any number of threads. Public, kept stable.

#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/model/description.hpp"

namespace grapnel {

template <class S>
struct Tree;  // the model in the form of the kernels (tree.hpp)

/// Thrown by ModelBuilder::build; what() lists all errors, one per line, each with the name of the body or frame.
class ModelError : public std::invalid_argument {
 public:
  explicit ModelError(std::vector<std::string> faults);
  const std::vector<std::string>& faults() const { return faults_; }

 private:
  std::vector<std::string> faults_;
};

/// Location of a body in the tree.
struct BodyPlacement {
  int link;    // index into Tree::links
  Posed X_LB;  // the body's frame in the link's internal frame
};

/// A body of a built model.
struct Body {
  BodyDescription description;
  int parent;               // index of the parent body; -1: the world
  int q;                    // first coordinate of its joint in State::q
  int v;                    // first velocity of its joint in State::v
  int root;                 // index of the root body of its tree
  BodyPlacement placement;  // in the kernels' tree
};

struct Frame {
  std::string name;
  int body;
  Posed X_BE;  // in the body's frame
};

/// A linear coupling of joints, made of JointDescription::mimic: q_dependent - sum of ratio q = offset. It constrains
/// the model where LoopSolver and impacts with coupling_rates() solve for the motion; the recursions alone ignore it.
struct JointCoupling {
  struct Joint {
    int body;       // that it moves
    double factor;  // 1 for the dependent joint, which comes first; -ratio for the others
  };
  std::vector<Joint> joints;
  double offset = 0;  // [rad or m]
};

/// See the file comment. Coordinates q: position p_WB [m] and quaternion_wxyz of R_WB for a free root, angle [rad] or
/// travel [m] for a joint, quaternion_wxyz for a spherical joint. Velocities v: V_WB expressed in B [angular; linear]
/// for a free root, rate for a joint, relative angular velocity in the child for a spherical joint.
class Model {
 public:
  Model();
  int coordinates() const { return coordinates_; }
  int velocities() const { return velocities_; }
  const std::vector<Body>& bodies() const { return bodies_; }
  const std::vector<Frame>& frames() const { return frames_; }
  const Tree<double>& tree() const { return *tree_; }
  /// Bodies with a one-degree-of-freedom joint, in the order of their velocities.
  const std::vector<int>& joints() const { return joints_; }
  /// The body that joint number `joint` of joints() moves.
  const Body& joint_body(std::size_t joint) const { return bodies_[joints_[joint]]; }
  /// Bodies with a joint whose rotor has a stated axis (JointDescription::rotor_axis); the parent carries the rotor.
  const std::vector<int>& rotors() const { return rotors_; }
  /// Bodies on joints with a spring (JointDescription::spring).
  const std::vector<int>& springs() const { return springs_; }
  /// Couplings of joints, in the order of their dependent joints. They are independent of each other: each has its own
  /// dependent joint, and these do not form cycles.
  const std::vector<JointCoupling>& couplings() const { return couplings_; }
  /// Offsets in State::q of every unit quaternion.
  const std::vector<int>& quaternions() const { return quaternions_; }
  /// Total mass [kg].
  double mass() const;

  /// Index of a named body or frame. @throws std::out_of_range with the name and the most similar existing names.
  int body_index(std::string_view name) const;
  int frame_index(std::string_view name) const;
  /// Whether the velocities of a body's tree root are free (6 degrees of freedom).
  bool has_free_root(int body) const;

 private:
  friend class ModelBuilder;
  void number(std::vector<BodyDescription> sorted, const std::vector<int>& parent);

  std::vector<Body> bodies_;
  std::vector<Frame> frames_;
  std::vector<int> joints_;
  std::vector<int> rotors_;
  std::vector<int> springs_;
  std::vector<int> quaternions_;
  std::vector<JointCoupling> couplings_;
  std::shared_ptr<const Tree<double>> tree_;
  int coordinates_ = 0, velocities_ = 0;
};

/// Collects bodies and frames in any order and builds a Model. Not thread safe.
class ModelBuilder {
 public:
  ModelBuilder() = default;
  /// Starts from an existing model, for additions or changes of joints.
  explicit ModelBuilder(const Model& model);

  ModelBuilder& add(BodyDescription body);
  ModelBuilder& add(FrameDescription frame);
  /// Replaces the joint of a body: `parent` then carries it by `joint` at X_PF. @throws std::out_of_range if a name is
  /// unknown.
  ModelBuilder& attach(std::string_view body, std::string_view parent, const Posed& X_PF, JointDescription joint);

  /// Validates and builds the model. Bodies are sorted parents first, otherwise in the order given. @throws ModelError
  /// with all errors: duplicate or unknown names, cycles, masses that are not positive, inertias that are not positive
  /// definite or violate the triangle inequality, axes without unit length, lower limits above upper limits, invalid
  /// modal chains, couplings with coupling_faults(), non-finite numbers.
  Model build() const&;
  /// As above for a temporary builder: moves the descriptions.
  Model build() &&;

 private:
  std::vector<BodyDescription> bodies_;
  std::vector<FrameDescription> frames_;
};

/// Error of an inertia tensor about the centre of mass: empty if it is physically possible, else one sentence. A
/// tolerance of 1e-9 of the trace allows for rounded published values, thin rods and plates.
std::string inertia_fault(const Symmetric3d& inertia);

}  // namespace grapnel
