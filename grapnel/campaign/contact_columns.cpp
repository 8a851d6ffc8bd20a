// Columns of contacts between shapes.
#include <algorithm>
#include <cmath>

#include "grapnel/campaign/column.hpp"
#include "grapnel/problem/contact_pairs.hpp"
#include "grapnel/result/result_documents.hpp"

namespace grapnel {
namespace {

// More pairs than this are stored only on request.
constexpr std::size_t kPairsByDefault = 10;

using Reports = std::vector<ContactPairReport>;

// NaN: the run ended before contacts were reported.
template <class Value>
auto of_all(Value value) {
  return [value](const StudyCase&, const CaptureResult& r) {
    return r.contacts.empty() ? double(NAN) : static_cast<double>(value(r.contacts));
  };
}

double sum(const Reports& pairs, double (*value)(const ContactPairReport&)) {
  double total = 0;
  for (const ContactPairReport& pair : pairs) total += value(pair);
  return total;
}
double loss_of(const ContactPairReport& pair) {
  const double impacts = pair.hard ? pair.hard->restitution_loss + pair.hard->friction_loss : 0;
  return pair.damping_loss + pair.friction_loss + impacts;
}
double largest(const Reports& pairs, double ContactPairReport::*member) {
  double found = 0;
  for (const ContactPairReport& pair : pairs) found = std::fmax(found, pair.*member);
  return found;
}

std::vector<Column> totals() {
  using C = ContactPairReport;
  return {{"contacts/touches", "1", "number of times that a contact began, over all pairs",
           of_all([](const Reports& all) { return sum(all, [](const C& c) { return double(c.touches); }); })},
          {"contacts/pairs", "1", "number of pairs that touched",
           of_all([](const Reports& all) { return sum(all, [](const C& c) { return double(c.touches > 0); }); })},
          {"contacts/first_time", "s", "start of the first contact of any pair; NaN: no contact",
           of_all([](const Reports& all) {
             double first = NAN;
             for (const C& c : all) first = std::fmin(first, c.first_time.value_or(NAN));
             return first;
           })},
          {"contacts/impulse", "N s", "time integral of the normal force, sum over all pairs",
           of_all([](const Reports& all) { return sum(all, [](const C& c) { return c.impulse; }); })},
          {"contacts/peak_force", "N", "largest normal force of any pair",
           of_all([](const Reports& all) { return largest(all, &C::peak_force); })},
          {"contacts/largest_depth", "m", "largest penetration of any pair",
           of_all([](const Reports& all) { return largest(all, &C::largest_depth); })},
          {"contacts/loss", "J", "energy dissipated by normal forces, friction and impacts, sum over all pairs",
           of_all([](const Reports& all) { return sum(all, loss_of); })},
          {"contacts/beyond_model", "1", "whether an overlap of any pair was too deep for the contact model",
           of_all([](const Reports& all) { return std::ranges::any_of(all, &C::beyond_model); })}};
}

Column impact_column() {
  return {"contacts/impacts", "1", "number of impacts in an instant, over all hard pairs",
          of_all([](const Reports& all) {
            return sum(all, [](const ContactPairReport& c) { return c.hard ? double(c.hard->impacts) : 0.0; });
          })};
}

// Columns of the impacts of one hard pair; NaN where there is no value.
void add_hard_columns(const std::string& a, const std::string& b, bool by_default, std::vector<Column>& columns) {
  for (const char* key :
       {"impacts", "fastest_impact", "last_time", "impulse", "restitution_loss", "friction_loss", "persistent_since"}) {
    const Field& field = *field_named(type_of<HardContactReport>(), key);
    const auto value = [a, b, &field](const StudyCase&, const CaptureResult& r) {
      for (const ContactPairReport& pair : r.contacts) {
        if (pair.body_a == a && pair.body_b == b && pair.hard) return number_in(field, &*pair.hard, 0);
      }
      return double(NAN);
    };
    columns.push_back({"contacts/" + a + "/" + b + "/hard/" + key, std::string(field.unit.empty() ? "1" : field.unit),
                       std::string(field.text), value, false, by_default});
  }
}

}  // namespace

std::vector<Column> contact_columns(const CaptureProblem& problem) {
  if (problem.contacts.empty()) return {};
  const std::vector<ContactPair> pairs = contact_pairs(problem, make_capture_system(problem));
  if (pairs.empty()) return {};
  std::vector<Column> columns = totals();
  const auto is_hard = [](const ContactPair& pair) { return pair.law.hard; };
  if (std::ranges::any_of(pairs, is_hard)) columns.push_back(impact_column());
  for (const ContactPair& bodies : pairs) {
    const std::string a = contact_name(problem, bodies.a), b = contact_name(problem, bodies.b);
    const bool by_default = pairs.size() <= kPairsByDefault;
    if (bodies.law.hard) add_hard_columns(a, b, by_default, columns);
    for (const char* key : {"touches", "touches_at_end", "first_time", "duration", "impulse", "peak_force",
                            "largest_depth", "slip_distance", "damping_loss", "friction_loss"}) {
      const Field& field = *field_named(type_of<ContactPairReport>(), key);
      const auto value = [a, b, &field](const StudyCase&, const CaptureResult& r) {
        for (const ContactPairReport& pair : r.contacts) {
          if (pair.body_a == a && pair.body_b == b) return number_in(field, &pair, 0);
        }
        return double(NAN);
      };
      columns.push_back({"contacts/" + a + "/" + b + "/" + key, std::string(field.unit.empty() ? "1" : field.unit),
                         std::string(field.text), value, false, by_default});
    }
  }
  return columns;
}

}  // namespace grapnel
