#pragma once

/// @file
/// The immutable description of a mechanical system: a forest of rigid bodies on joints, with named frames.
///
/// A servicer is a tree whose root is its base; a free target is a tree of one body. A model is built once by
/// ModelBuilder, checked as a whole, and never changes; a capture makes a new model in which the target hangs on the
/// arm. Thread safety: a Model is immutable and may be read from any number of threads. Public, kept stable.

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/model/description.hpp"
#include "grapnel/model/tree.hpp"

namespace grapnel {

/// Thrown by ModelBuilder::build; what() lists every fault found, one a line, each naming the body or frame.
class ModelError : public std::invalid_argument {
 public:
  explicit ModelError(std::vector<std::string> faults);
  const std::vector<std::string>& faults() const { return faults_; }

 private:
  std::vector<std::string> faults_;
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

/// See the file comment. Coordinates q: a free root contributes its position p_WB [m] and its quaternion_wxyz of R_WB,
/// a joint its angle [rad] or travel [m], a spherical joint quaternion_wxyz. Velocities v: a free root contributes V_WB
/// expressed in B [angular; linear], a joint its rate, a spherical joint the relative angular velocity in the child.
class Model {
 public:
  int coordinates() const { return tree_.coordinates; }
  int velocities() const { return tree_.velocities; }
  const std::vector<Body>& bodies() const { return bodies_; }
  const std::vector<Frame>& frames() const { return frames_; }
  const Tree<double>& tree() const { return tree_; }
  /// Bodies with a one-degree-of-freedom joint, in the order of their velocities.
  const std::vector<int>& joints() const { return joints_; }
  /// Bodies with a joint whose rotor's spin counts (JointDescription::rotor_axis); the parent carries it.
  const std::vector<int>& rotors() const { return rotors_; }
  /// Bodies on a joint with a spring (JointDescription::spring).
  const std::vector<int>& springs() const { return springs_; }
  /// Offsets in State::q of every unit quaternion.
  const std::vector<int>& quaternions() const { return quaternions_; }
  /// Total mass [kg].
  double mass() const;

  /// Index of a named body or frame. @throws std::out_of_range naming it and the nearest names there are.
  int body_index(std::string_view name) const;
  int frame_index(std::string_view name) const;
  /// Whether the velocities of a body's tree root are free (6 degrees of freedom).
  bool has_free_root(int body) const;

 private:
  friend class ModelBuilder;
  std::vector<Body> bodies_;
  std::vector<Frame> frames_;
  std::vector<int> joints_;
  std::vector<int> rotors_;
  std::vector<int> springs_;
  std::vector<int> quaternions_;
  Tree<double> tree_;
};

/// Collects bodies and frames in any order and builds a Model. Not thread safe.
class ModelBuilder {
 public:
  ModelBuilder() = default;
  /// Starts from an existing model, to add to it or to change what carries a body.
  explicit ModelBuilder(const Model& model);

  ModelBuilder& add(BodyDescription body);
  ModelBuilder& add(FrameDescription frame);
  /// Replaces the joint of a body: it then hangs on `parent` by `joint` at X_PF. @throws std::out_of_range if unknown.
  ModelBuilder& attach(std::string_view body, std::string_view parent, const Posed& X_PF, JointDescription joint);

  /// Checks everything at once and builds. Bodies are sorted parents first, otherwise in the order given.
  /// @throws ModelError with all faults: duplicate or unknown names, cycles, masses not positive, inertias not positive
  /// definite or against the triangle inequality, axes not of unit length, limits the wrong way round, chains of joints
  /// with modes that are none, non-finite numbers.
  Model build() const&;
  /// The same, of a builder that is needed no more: descriptions are moved.
  Model build() &&;

 private:
  std::vector<BodyDescription> bodies_;
  std::vector<FrameDescription> frames_;
};

/// Faults of an inertia tensor about the centre of mass: empty if it can belong to a body, else one sentence. A slack
/// of 1e-9 of the trace allows for published numbers that are rounded (and for thin rods and plates).
std::string inertia_fault(const Symmetric3d& inertia);

}  // namespace grapnel
