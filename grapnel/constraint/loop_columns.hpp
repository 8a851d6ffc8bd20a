#pragma once

/// @file
/// Unit wrenches of loop closures carried through the articulated tree: the kernel of the range-space method.
///
/// With M = U D U^T as in the recursion of forward dynamics, a wrench F on a link gives K = S^T F at its joint, and
/// passes F - G K, G = I S / D, to the parent. The rows Y = D^-1/2 K of all joints of the chain, and Y = D^-1/2 L^-1 F
/// at a free root with I = L D L^T, are D^-1/2 U^-1 J^T, so that
///
///   W = J M^-1 J^T = Y^T Y                                                                                     (8.7)
///
/// costs a number of operations proportional to the number of joints in the closure's chain. A modal chain has the rows
/// L^-1 (sum of s^T K) for all its modes. Joints with prescribed acceleration pass wrenches on unchanged and have no
/// row. The same wrenches give the closure's relative acceleration without multipliers before any acceleration is
/// computed. A link's acceleration A = X A_parent + c + S (g - G.A) contributes K g + (F - G K).c to F.A; the remainder
/// belongs to the parent. A closure between two trees has a chain to each root.
///
/// The row of a coupling of joints (JointCoupling) is the unit effort `factor` at each of its joints. An effort adds to
/// K at its joint, and the wrench -G K that it causes on the parent is carried from there: (8.14) of docs/theory.

#include <vector>

#include "grapnel/constraint/loop_closure.hpp"
#include "grapnel/dynamics/articulated_body.hpp"

namespace grapnel {

// A loop closure in terms of links, with the chains from both sides to their common ancestor, or to the roots of two
// trees. Reads the links' scratch of articulated_body() or `follow`. Thread safety: immutable; functions write their
// outputs only.

/// See the file comment. Row r of a closure is the direction angular_rows[r] for the first `angular_count` rows and the
/// axis r - angular_count of C for the linear ones that follow: three, or none.
struct LoopPath {
  int link_a = 0, link_b = 0;
  Posed X_aC = Posed::identity();   // in link a's frame
  Posed X_bD = Posed::identity();   // in link b's frame
  std::vector<int> from_a, from_b;  // links from a and from b upwards, without the common ancestor or the roots
  std::vector<int> trunk;           // from the common ancestor to the root; empty between two trees
  int root_a = 0, root_b = 0;       // root links; equal within one tree
  int rows = 0, first_row = 0;
  int angular_count = 0;
  GraspModel model = GraspModel::rigid;
  Vector3d hinge_C;
  Vector3d angular_rows[3];  // in C
  /// Units of the rows such that body b, alone and free, has unit mobility: roots of mean inverse inertias [rad, m].
  double angular_scale = 1, linear_scale = 1;

  bool one_tree() const { return root_a == root_b; }
  int linear_count() const { return rows - angular_count; }
  double scale(int row) const { return row < angular_count ? angular_scale : linear_scale; }
};

/// @throws std::invalid_argument if no joint separates the bodies (one link, or two roots fixed to the world), or if
/// the frames are not valid poses.
LoopPath make_loop_path(const Model& model, const LoopClosure& closure);

/// A coupling of joints in terms of links: one row.
struct CouplingPath {
  struct Joint {
    int link, q, v;  // its link, coordinate and velocity
    double factor;
  };
  std::vector<Joint> joints;  // the dependent one first
  double offset = 0;
  int row = 0;
  double scale = 1;     // unit of the row, as LoopPath's
  bool slides = false;  // its defect is a length
};
/// Paths of all couplings of a model, in rows from `first_row` on.
std::vector<CouplingPath> make_coupling_paths(const Model& model, int first_row);
/// Sum of factor q - offset; sum of factor times the velocities or accelerations v.
double coupling_position(const CouplingPath& path, std::span<const double> q);
double coupling_motion(const CouplingPath& path, std::span<const double> v);
/// Sum of |factor| max(|v|, least): the size of the terms of coupling_motion().
double coupling_motion_size(const CouplingPath& path, std::span<const double> v, double least);

/// Mobility of a body alone and free, for the rows' units; in its link's frame.
struct LoneBody {
  Symmetric3d inverse_inertia;  // about its centre of mass
  double inverse_mass;
  Vector3d com;
  explicit LoneBody(const Body& body);
  /// Sets a path's scales for a grasp at point p of the link.
  void scale_rows(const Vector3d& p, LoopPath& path) const;
};

/// Present pose of a closure.
struct LoopPlace {
  Posed X_bC;  // of C in link b
};
/// Pose from the links' angles and offsets in `links` (`place` or articulated_body()); between two trees also from the
/// roots' coordinates in q.
LoopPlace locate(const LoopPath& path, const Tree<double>& tree, std::span<const LinkScratch<double>> links,
                 std::span<const double> q);

/// Velocity change times time dq => coordinates q: adds joint and position increments, rotates quaternions by the
/// exponential map.
void step_coordinates(const Tree<double>& tree, std::span<const double> dq, std::span<double> q);

/// Pose of D in C: the identity if the loop is closed (except in its free directions).
Posed pose_CD(const LoopPath& path, const LoopPlace& place);

/// A motion of C minus that of D, both at C in C's axes, for motions of links a and b in their frames.
template <SpatialKind kKind>
SpatialVector<kKind> relative_motion(const LoopPath& path, const LoopPlace& place, const SpatialVector<kKind>& of_a,
                                     const SpatialVector<kKind>& of_b) {
  return transposed_times(path.X_aC.R, shift(of_a, path.X_aC.p)) -
         transposed_times(place.X_bC.R, shift(of_b, place.X_bC.p));
}

/// The closure's rows of a relative motion.
template <SpatialKind kKind>
void take_rows(const LoopPath& path, const SpatialVector<kKind>& relative, std::span<double> rows) {
  for (int r = 0; r < path.angular_count; ++r) rows[r] = dot(path.angular_rows[r], relative.angular);
  for (int r = 0; r < path.linear_count(); ++r) rows[path.angular_count + r] = relative.linear[r];
}

/// Position defect as rows of C minus D. Its rate equals the rows of the relative twist in the limit of zero defect.
void position_rows(const LoopPath& path, const LoopPlace& place, std::span<double> rows);

/// One number per row of one closure, padded with zeros: one vector register, or two.
struct ClosureRow {
  using Pack = double __attribute__((vector_size(64)));
  Pack r;
};

class LoopColumns {
 public:
  /// Rows of closures come first, then those of couplings.
  LoopColumns(const Tree<double>& tree, std::span<const LoopPath> paths, std::span<const CouplingPath> couplings = {});

  /// Carries the unit wrenches of all closures and the unit efforts of all couplings to the root. `workspace`: the
  /// result of articulated_inertias() for `in`.
  void carry(std::span<const LoopPath> paths, std::span<const LoopPlace> places,
             const DynamicsWorkspace<double>& workspace, const DynamicsInput<double>& in);

  /// W, rows x rows, row-major.
  void contact_inertia(std::span<double> W) const;

  /// The relative acceleration of C and D due to the forces of carry()'s `in` alone, without V_C x V_D, per row; and
  /// the sum of the squares of its terms.
  const ClosureRow& free_acceleration(std::size_t closure) const { return sums_[closure].acceleration; }
  const ClosureRow& free_acceleration_squares(std::size_t closure) const { return sums_[closure].squares; }
  /// Likewise of a coupling: the sum of factor times acceleration, in the first number.
  const ClosureRow& coupled_acceleration(std::size_t coupling) const {
    return sums_[closures_ + coupling].acceleration;
  }
  const ClosureRow& coupled_acceleration_squares(std::size_t coupling) const {
    return sums_[closures_ + coupling].squares;
  }

  /// Applies wrenches and efforts, or impulses, `rows` in the third sweep, articulated_accelerations().
  void impose(std::span<const double> rows, std::span<const std::uint8_t> prescribed,
              DynamicsWorkspace<double>& workspace) const;

  /// Removes the effect of impose() from links that articulated_inertias() computed at rest without forces.
  void release(DynamicsWorkspace<double>& workspace) const;

 private:
  // Location of a closure's rows at one link: from `slot` on in y_ and raw_.
  struct Step {
    int link, slot;
  };
  // Chain of one closure, in order.
  struct LinkSequence {
    // Ranges in steps_: from a, from b, from their common ancestor, then the root; between two trees the roots of a and
    // b.
    int first_step, end_a, end_b, first_root, end;
    int first_slot, end_slot;
    int first_row, rows;
    ClosureRow unit[6];  // unit wrenches of the rows at C, in its axes, by component
  };
  struct Sums {
    ClosureRow acceleration, squares;
  };
  // One joint of a coupling, and its chain to the root with separate slots, the root last.
  struct CoupledJoint {
    double factor;
    std::vector<Step> chain;
    std::vector<int> slots;  // of the coupling, to which those of the chain are added
  };
  // What a climb reads, and the sums to which it adds.
  struct Climb {
    const DynamicsWorkspace<double>& workspace;
    const DynamicsInput<double>& in;
    ClosureRow::Pack sum{}, squares{};
  };
  struct RootFactor {
    double L[6][6];                      // below the diagonal; the upper triangle is not used
    double inverse[6], inverse_root[6];  // of D
    double y[6];                         // L^-1 (F - p)
  };
  struct Pair {
    struct Slots {
      int of_k, of_l;
    };
    int closure_k, closure_l;
    std::vector<Slots> slots;
  };
  bool is_prescribed(std::span<const std::uint8_t> prescribed, int link) const {
    return !prescribed.empty() && prescribed[tree_.links[link].v] != 0;
  }
  int slots_of(int link) const;
  void add_closure(const LoopPath& path, int& slot);
  void add_coupling(const CouplingPath& coupling, int& slot);
  void find_pairs();
  template <class Bundle>
  void climb(Bundle& b, std::span<const Step> steps, std::span<ClosureRow> shares, double effort, Climb& sums);
  void carry_closure(std::size_t k, const LoopPath& path, const LoopPlace& place, Climb& sums);
  void carry_coupling(std::size_t k, Climb& sums);
  std::span<const Step> steps(int first, int end) const { return std::span(steps_).subspan(first, end - first); }
  void arrive(const Step& step, const ClosureRow::Pack (&F)[6], const DynamicsInput<double>& in,
              ClosureRow::Pack& free);
  void factor_root(int link, const LinkScratch<double>& w, const DynamicsInput<double>& in);

  const Tree<double>& tree_;
  std::vector<Step> steps_;
  std::vector<LinkSequence> sequences_;
  std::vector<Pair> pairs_;                         // closures with common links
  std::vector<ClosureRow> y_;                       // zero if prescribed
  std::vector<ClosureRow> raw_;                     // S^T F at prescribed and spherical joints, F at roots
  std::vector<ClosureRow> shares_, shares_of_b_;    // of the present modal chain, per mode: work of the wrenches on it
  std::vector<Sums> sums_;                          // per closure, then per coupling
  std::size_t closures_ = 0;                        // their number
  std::vector<std::vector<CoupledJoint>> coupled_;  // per coupling
  std::vector<double> inverse_root_;                // per link: D^-1/2
  std::vector<int> roots_;                          // free roots with loops
  std::vector<RootFactor> root_factor_;             // likewise
  std::vector<int> root_factor_of_;                 // per link
};

}  // namespace grapnel
