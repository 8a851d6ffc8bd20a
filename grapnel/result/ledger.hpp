#pragma once

/// @file
/// The conservation checks of a capture: each conserved or balanced quantity with its largest deviation, the bound it
/// must keep, and whether it did.

#include <string>
#include <vector>

#include "grapnel/describe/type.hpp"

namespace grapnel {

/// Three answers: a verdict never says more than was checked.
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
  /// conservation: a failure means that the computation cannot be trusted. feasibility: it means that the robot could
  /// not do this (limits passed, bodies that overlap).
  enum class Kind { conservation, feasibility };
  Kind kind = Kind::conservation;
  std::string not_checked = {};  // why nobody looked, although there is something to look at; empty: it was checked
  std::string advice = {};       // of a row of conservation that fails: what mends it, or why nothing does
  bool pass() const { return !applies || value <= bound; }  // NaN fails
};

/// What drifts are relative to; none can vanish while something moves (docs/theory, section 9).
struct LedgerScale {
  double linear_momentum = 0;   // max over time of sum |m v| [N s]
  double angular_momentum = 0;  // max over time of sum (|I w| + |r x m v|), r from the system's centre of mass [N m s]
  double energy = 0;            // largest kinetic energy [J]
};

struct Ledger {
  std::vector<LedgerEntry> entries;
  LedgerScale scale;
  /// Whether the physics was kept. If it was not, the run is no result.
  bool pass() const { return passes(LedgerEntry::Kind::conservation); }
  /// The row of conservation that is beyond its bound by the largest factor; null if all pass. The first of equals.
  const LedgerEntry* worst_failure() const;
  /// Whether joints stayed within their limits and bodies clear of each other.
  bool feasible() const { return passes(LedgerEntry::Kind::feasibility); }
  /// The same as an answer: no, if anything was found; not checked, if anything was not looked at.
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

/// A row that fails, in words: "energy_drift is 1.35e-09, bound 1e-10".
std::string failure_text(const LedgerEntry& entry);

}  // namespace grapnel
