#pragma once

/// @file
/// The nodes of a path segment, one in every lane: plain data, which files compiled for an instruction set may see, and
/// what they compute. A panel's nodes fill the lanes of every set. segment_node_packs.hpp has the equations.

#include "grapnel/model/tree.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

inline constexpr int kPanelNodes = 16;
/// Sums over nodes are kept in as many parts, of nodes whose numbers leave the same remainder, and added up in the end:
/// so that their bits do not depend on how many lanes there are.
inline constexpr int kSumParts = 8;

/// Where a node's numbers stand among its own, in the order of PlacedNumbers and those of path_segment.hpp.
struct NodeLayout {
  int X_BL, axis, composite, inertia, joint_momentum, k;  // first of all links or joints
  int com, mass, H_inverse;
  int u, R, w_B, Phi;  // R row by row, Phi column by column
  int rate;            // of the joints
  int g;               // (6) of floating_base.hpp, per joint
  int g_turned;        // what g_j adds to the integrand of (3), per joint, and
  int k_turned;        // what k_j adds
  int size;
};

/// The servicer, the collocation and the layout.
struct NodeTables {
  const TreeLink<double>* links;
  int link_count, coordinates;
  const int *joint_link, *link_joint;
  int joints, knots;
  NodeLayout layout;
  const double* a;  // a_ij of the collocation at [j kPanelNodes + i]
};

/// One panel of a flight.
struct NodePanel {
  bool floats, turns;  // FloatingBase's
  bool driven;         // L is not zero
  Vector3d L;          // angular momentum about the centre of mass, in W
  double h;            // length of the panel [s]
  int first, nodes;    // its first node; of all panels
  int kept;            // where its numbers stand: node `kept` of SegmentNodes::numbers
  // Of the joints: theta = start + a (final - start) + b final_rate + c start_rate + sum_k coefficient_k N_k.
  const double *start, *start_rate, *final, *final_rate;
  const double* coefficients;
  int coefficient_count;
  const double* basis;   // a, b, c, N_0...: values of all nodes, then rates of all nodes, of each
  const double* weight;  // of all nodes

  // turn(): the quaternion where it begins; its rates over the panel and angular velocities, at the nodes.
  double q[4];
  double q_rate[4][kPanelNodes];  // times h
  double w_B[3][kPanelNodes];
  // sensitivities(): Phi where it begins, column by column, its rates, and the integral of (3): three sums in kSumParts
  // parts per unknown.
  double Phi[9];
  double Phi_rate[9][kPanelNodes];
  double* sums;
};

/// In the packs of an instruction set. Bits do not depend on the set.
class SegmentNodes {
 public:
  SegmentNodes() = default;
  SegmentNodes(const SegmentNodes&) = delete;
  SegmentNodes& operator=(const SegmentNodes&) = delete;
  virtual ~SegmentNodes();

  /// Makes room for the numbers of so many nodes, a multiple of kPanelNodes; what was there is lost.
  virtual void reserve(int nodes) = 0;
  /// Places the links.
  virtual void place(NodePanel& panel) = 0;
  /// Then the rotation at the nodes, by fixed-point iteration; false where that does not converge.
  virtual bool turn(NodePanel& panel) = 0;
  /// Then Phi and the sums. The latter are only added to.
  virtual void sensitivities(NodePanel& panel) = 0;

  /// Number `index` (NodeLayout) of node n stands at [((n / lanes) size + index) lanes + n % lanes].
  const double* numbers = nullptr;
  int lanes = 1;
};

/// Once per instruction set; each is defined where it is compiled for its set. `tables` is copied, what it leads to
/// must outlive what is made, which the caller deletes.
SegmentNodes* make_segment_nodes_one_lane(const NodeTables& tables);
SegmentNodes* make_segment_nodes_sse2(const NodeTables& tables);
SegmentNodes* make_segment_nodes_avx2(const NodeTables& tables);
SegmentNodes* make_segment_nodes_avx512(const NodeTables& tables);

}  // namespace grapnel
