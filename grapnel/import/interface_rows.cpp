#include "grapnel/import/interface_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>

#include "grapnel/import/expanded_nodes.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

class InterfaceRows {
 public:
  InterfaceRows(const ElementMatrix& mass, const ElementMatrix& stiffness, FaultList& faults)
      : mass_(mass), stiffness_(stiffness), faults_(faults) {}

  std::optional<ModelParts> find(const ElementInterface& interface) {
    is_taken_.assign(static_cast<std::size_t>(mass_.size()), false);
    if (mass_.dofs.empty() ? !by_rows(interface) : !by_names(interface)) return std::nullopt;
    if (motions_.size() < 6) {
      faults_.add(mark_of(mass_), "the interface needs six rows");
      return std::nullopt;
    }
    parts_.motion.resize(static_cast<Eigen::Index>(motions_.size()), 6);
    for (std::size_t i = 0; i < motions_.size(); ++i) {
      for (std::size_t k = 0; k < 6; ++k)
        parts_.motion(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) = motions_[i][k];
    }
    Eigen::MatrixXd scaled = parts_.motion;
    for (Eigen::Index k = 0; k < 6; ++k) {
      if (const double size = scaled.col(k).norm(); size > 0) scaled.col(k) /= size;
    }
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(scaled, Eigen::ComputeThinU | Eigen::ComputeThinV);
    if (!(svd.singularValues()[5] > 1e-9 * svd.singularValues()[0])) {
      faults_.add(
          interface.nodes.empty() ? mark_of(mass_) : interface.nodes[0].mark,
          "the nodes of the interface do not fix it: it needs three nodes that are not on one line, or nodes with "
          "rotations");
      return std::nullopt;
    }
    for (int row = 0; row < mass_.size(); ++row) {
      if (!is_taken_[static_cast<std::size_t>(row)]) parts_.inner.push_back(row);
    }
    return std::move(parts_);
  }

 private:
  Mark mark_of(const ElementMatrix& m) const { return {std::make_shared<const std::string>(m.name), 0, 0}; }

  bool take(int row, const std::array<double, 6>& motion) {
    if (is_taken_[static_cast<std::size_t>(row)]) return false;
    is_taken_[static_cast<std::size_t>(row)] = true;
    parts_.boundary.push_back(row);
    motions_.push_back(motion);
    return true;
  }

  bool by_rows(const ElementInterface& interface) {
    if (interface.node || !interface.nodes.empty()) {
      faults_.add(mark_of(mass_),
                  "the rows of these matrices have no names, so state the interface by rows, not by nodes; a "
                  "file with the ending .dof beside the matrix, or --row-names, can name them");
      return false;
    }
    for (std::size_t k = 0; k < interface.rows.size(); ++k) {
      const int row = interface.rows[k];
      std::array<double, 6> motion{};
      motion[k] = 1;
      if (row >= 0 && row < mass_.size() && take(row, motion)) continue;
      faults_.add(mark_of(mass_), fmt::format("the interface needs six different rows from 1 to {}; {} is not one",
                                              mass_.size(), row + 1));
      return false;
    }
    return true;
  }

  bool by_names(const ElementInterface& interface) {
    if (interface.rows.empty()) return by_nodes(interface);
    faults_.add(mark_of(mass_), "the rows of these matrices have names, so state the interface by nodes, not by rows");
    return false;
  }

  const std::vector<int>& rows_of(const ElementDof& dof) {
    static const std::vector<int> none;
    if (rows_.empty()) {
      for (int row = 0; row < mass_.size(); ++row) rows_[mass_.dofs[static_cast<std::size_t>(row)]].push_back(row);
    }
    const auto found = rows_.find(dof);
    return found == rows_.end() ? none : found->second;
  }

  // Whether the node's components are along the model's axes.
  bool has_model_axes(long long node, const Mark& mark) {
    for (const ElementMatrix* m : {&mass_, &stiffness_}) {
      const auto found = m->rotated_nodes.find(node);
      if (found == m->rotated_nodes.end()) continue;
      faults_.add(mark, fmt::format("node {} has displacements in coordinate system {} (field CD of its GRID entry), "
                                    "not in the model's: nodes of the interface must have CD 0",
                                    node, found->second));
      return false;
    }
    return true;
  }

  bool by_nodes(const ElementInterface& interface) {
    if (interface.node) return by_node(*interface.node);
    if (interface.nodes.empty()) {
      faults_.add(mark_of(mass_), "the interface is missing: name its node, or a list of nodes that form it");
      return false;
    }
    bool all = true;
    std::vector<ExpandedRow> expanded, known;
    for (const NodePlace& node : interface.nodes) {
      if (!has_model_axes(node.node, node.mark)) {
        all = false;
        continue;
      }
      bool any = false;
      const std::array<double, 3> p{node.x, node.y, node.z};
      for (std::size_t k = 0; k < 6; ++k) {
        const std::vector<int>& rows = rows_of({node.node, static_cast<int>(k) + 1});
        any |= !rows.empty();
        for (const int row : rows) {
          if (k < 3) (rows.size() > 1 ? expanded : known).push_back({row, node.node, static_cast<int>(k) + 1, p});
        }
        if (rows.size() != 1) continue;
        std::array<double, 6> motion{};
        motion[k] = 1;
        if (k < 3) {  // (theta x p)_k
          motion[3 + (k + 1) % 3] = p[(k + 2) % 3];
          motion[3 + (k + 2) % 3] = -p[(k + 1) % 3];
        }
        take(rows[0], motion);
      }
      if (!any) {
        faults_.add(node.mark, fmt::format("node {} is not in the matrices", node.node));
        all = false;
      }
    }
    return all && (expanded.empty() || take_expanded(interface, std::move(expanded), std::move(known)));
  }

  bool by_node(long long node) {
    if (!has_model_axes(node, mark_of(stiffness_))) return false;
    std::vector<int> missing;
    for (int k = 0; k < 6; ++k) {
      const std::vector<int>& rows = rows_of({node, k + 1});
      if (rows.size() > 1) {
        faults_.add(
            mark_of(mass_),
            fmt::format("{} names {} rows: node {} belongs to shells or beams that were expanded to solids. State "
                        "the nodes where the body is attached as a list of nodes",
                        ElementDof{node, k + 1}.text(), rows.size(), node));
        return false;
      }
      std::array<double, 6> motion{};
      motion[static_cast<std::size_t>(k)] = 1;
      if (rows.empty() || !take(rows[0], motion)) missing.push_back(k + 1);
    }
    if (missing.empty()) return true;
    if (missing.size() == 6) {
      std::vector<std::string> nodes;
      for (const ElementDof& dof : mass_.dofs) {
        const std::string text = std::to_string(dof.node);
        if (nodes.empty() || nodes.back() != text) nodes.push_back(text);
      }
      faults_.add(mark_of(mass_), fmt::format("the interface, node {}, is not in the matrices; their nodes are {}",
                                              node, some_of(nodes)));
      return false;
    }
    std::string list;
    for (int k : missing) list += fmt::format("{}{}", list.empty() ? "" : ", ", k);
    faults_.add(mark_of(mass_),
                fmt::format("node {} lacks {} {} in the matrices, as nodes of solid elements or of a support: state "
                            "the nodes of the face where the body is attached as a list of nodes",
                            node, missing.size() == 1 ? "component" : "components", list));
    return false;
  }

  // Rows of shells and beams that were expanded to solids.
  bool take_expanded(const ElementInterface& interface, std::vector<ExpandedRow> rows, std::vector<ExpandedRow> known) {
    for (const NodePlace& node : interface.others) {
      for (int k = 1; k <= 3; ++k) {
        for (const int row : rows_of({node.node, k})) known.push_back({row, node.node, k, {node.x, node.y, node.z}});
      }
    }
    std::sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) { return a.row < b.row; });
    std::string reason;
    const auto motions = expanded_motions(stiffness_.A, rows, known, reason);
    if (!motions) {
      faults_.add(
          interface.nodes[0].mark,
          fmt::format("names of rows repeat, as for shells and beams that CalculiX expands to solids: {}", reason));
      return false;
    }
    for (std::size_t i = 0; i < rows.size(); ++i) take(rows[i].row, (*motions)[i]);
    return true;
  }

  const ElementMatrix& mass_;
  const ElementMatrix& stiffness_;
  FaultList& faults_;
  ModelParts parts_;
  std::vector<bool> is_taken_;
  std::vector<std::array<double, 6>> motions_;
  std::map<ElementDof, std::vector<int>> rows_;  // by names, if they exist
};

}  // namespace

std::optional<ModelParts> interface_rows(const ElementMatrix& mass, const ElementMatrix& stiffness,
                                         const ElementInterface& interface, FaultList& faults) {
  return InterfaceRows(mass, stiffness, faults).find(interface);
}

}  // namespace grapnel
