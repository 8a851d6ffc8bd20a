#include "campaign/fake_campaign.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>

namespace grapnel::test {

namespace fs = std::filesystem;

Campaign fake_campaign(std::uint64_t cases) {
  Campaign campaign;
  campaign.name = "fake";
  campaign.description = "numbers of no meaning";
  campaign.file = "fake.yaml";
  campaign.text = "name: fake\ncases: some\n";
  campaign.sha256 = "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef";
  campaign.cases = cases;
  campaign.seed = 7;
  campaign.inputs = {{"mass", "kg", "mass"}, {"spin/x", "rad/s", "spin"}};
  campaign.columns = {{"a", "N s", "first", {}}, {"b/x", "1", "second", {}}, {"b/y", "", "third", {}}};
  const std::vector<std::string> names{"a", "b/x", "b/y", "mass", "spin/x"};
  campaign.success = {Criterion::parse("a < 0.5", names)};
  campaign.series = {2, 3, 1, "a"};
  campaign.time_limit = 2.5;
  return campaign;
}

CaseRow fake_row(std::uint64_t k) {
  CaseRow row;
  row.index = k;
  const auto noise = [&](std::uint64_t n) {
    std::uint64_t x = (k * 5 + n) * 0x9e3779b97f4a7c15u;
    x ^= x >> 31;
    return static_cast<double>(x * 0xbf58476d1ce4e5b9u >> 11) * 0x1p-53;
  };
  row.inputs = {noise(0), -noise(1)};
  row.status = k % 7 == 3 ? CaseStatus::failed : k % 11 == 4 ? CaseStatus::unreachable : CaseStatus::ok;
  if (row.status == CaseStatus::ok) {
    const double odd[] = {-0.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::denorm_min(),
                          std::bit_cast<double>(std::uint64_t{0x7ff8000000000abc})};
    row.values = {noise(2), odd[k % 4], noise(4)};
    row.success = row.values[0] < 0.5;
  } else {
    row.values.assign(3, NAN);
    row.reason = k % 2 == 0 ? "diverged at 3 s" : "zu schnell für " + std::to_string(k % 5) + " mm";
  }
  return row;
}

BlockWork fake_work() {
  return [](const Block& block, const std::stop_token& stop) {
    std::vector<CaseRow> rows;
    for (std::uint64_t k = block.begin; k < block.end && !stop.stop_requested(); ++k) rows.push_back(fake_row(k));
    return rows;
  };
}

bool same_row(const CaseRow& a, const CaseRow& b) {
  const auto same = [](const std::vector<double>& x, const std::vector<double>& y) {
    return x.size() == y.size() && std::memcmp(x.data(), y.data(), x.size() * sizeof(double)) == 0;
  };
  return a.index == b.index && a.status == b.status && a.success == b.success && a.reason == b.reason &&
         same(a.inputs, b.inputs) && same(a.values, b.values);
}

std::vector<CaseRow> rows_in(const fs::path& folder, const Campaign& campaign) {
  std::vector<CaseRow> all;
  for_each_block(folder, campaign, [&](std::vector<CaseRow>&& rows) {
    for (CaseRow& row : rows) all.push_back(std::move(row));
  });
  return all;
}

void expect_fake_rows(const fs::path& folder, const Campaign& campaign, std::uint64_t total) {
  const std::vector<CaseRow> rows = rows_in(folder, campaign);
  ASSERT_EQ(rows.size(), total);
  for (std::uint64_t k = 0; k < total; ++k) ASSERT_TRUE(same_row(rows[k], fake_row(k))) << k;
}

std::string bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

void write_bytes(const fs::path& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }

}  // namespace grapnel::test
