#pragma once

/// @file
/// The conservation checks of a capture: each conserved or balanced quantity with its largest deviation, its bound, and
/// whether it passes.

#include <string>
#include <vector>

#include "grapnel/describe/type.hpp"

namespace grapnel {

/// `not_checked`: at least one check was not evaluated, and none failed.
enum class Verdict { yes, no, not_checked };
template <>
const Type& type_of<Verdict>();

/// One line. `value` is relative to the scale its note names unless the unit says otherwise.
struct LedgerEntry {
  std::string name;  // key in summary.json
  double value = 0;
  double bound = 0;
  std::string unit = "1";
  std::string note;     // what is compared, over which phases
  bool applies = true;  // false: there is nothing to check in this run (no closed loop, say); value is then 0
  /// conservation: a failure invalidates the computation. feasibility: a failure means that a real robot could not
  /// perform the motion (exceeded limits, overlapping bodies).
  enum class Kind { conservation, feasibility };
  Kind kind = Kind::conservation;
  std::string not_checked = {};  // reason for which the check was not evaluated; empty: it was evaluated
  std::string advice = {};       // for a failed conservation row: how to correct it, or why no correction exists
  bool pass() const { return !applies || value <= bound; }  // NaN fails
};

/// Scales of relative drifts; none vanishes while a body moves (docs/theory, section 9).
struct LedgerScale {
  double linear_momentum = 0;   // max over time of sum |m v| [N s]
  double angular_momentum = 0;  // max over time of sum (|I w| + |r x m v|), r from the system's centre of mass [N m s]
  double energy = 0;            // largest kinetic energy [J]
};

struct Ledger {
  std::vector<LedgerEntry> entries;
  LedgerScale scale;
  /// Whether all conservation rows pass. If not, the run is not a valid result.
  bool pass() const { return passes(LedgerEntry::Kind::conservation); }
  /// The conservation row that exceeds its bound by the largest factor, the first of equals; null if all pass.
  const LedgerEntry* worst_failure() const;
  /// Whether joints stayed within their limits and bodies kept their clearance.
  bool feasible() const { return passes(LedgerEntry::Kind::feasibility); }
  /// The same as a verdict: `no` with any violation; `not_checked` if a check was not evaluated.
  Verdict feasibility() const {
    Verdict verdict = Verdict::not_checked;
    for (const LedgerEntry& e : entries) {
      if (e.kind != LedgerEntry::Kind::feasibility) continue;
      if (!e.pass()) return Verdict::no;
      if (verdict == Verdict::not_checked && e.applies) verdict = Verdict::yes;
    }
    for (const LedgerEntry& e : entries) {
      if (e.kind == LedgerEntry::Kind::feasibility && !e.not_checked.empty()) return Verdict::not_checked;
    }
    return verdict;
  }

 private:
  bool passes(LedgerEntry::Kind kind) const {
    for (const LedgerEntry& e : entries) {
      if (e.kind == kind && !e.pass()) return false;
    }
    return true;
  }
};

/// A failed row as text: "energy_drift is 1.35e-09, bound 1e-10".
std::string failure_text(const LedgerEntry& entry);

}  // namespace grapnel
