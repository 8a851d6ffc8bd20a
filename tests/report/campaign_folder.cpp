#include "report/campaign_folder.hpp"

#include <cmath>

#include "grapnel/result/hdf5_file.hpp"
#include "result/sample_result.hpp"

namespace grapnel::test {
namespace {

using hdf5::Handle;
using nlohmann::ordered_json;

bool is_failed(std::uint64_t k) { return k % 50 == 13; }

void describe(const Handle& dataset, const char* name, const char* unit, const char* description) {
  hdf5::write_attribute(dataset, "name", std::string(name));
  hdf5::write_attribute(dataset, "unit", unit);
  hdf5::write_attribute(dataset, "description", description);
}

void write_root(const Handle& file, const MadeCampaign& made) {
  const Handle root(H5Gopen2(file.id(), "/", H5P_DEFAULT), H5Gclose, "root");
  hdf5::write_attribute(root, "schema", made.schema);
  hdf5::write_attribute(root, "sha256", made.sha256);
}

}  // namespace

double made_mass(std::uint64_t k) { return 10 + std::sin(static_cast<double>(k)); }
double made_impulse(std::uint64_t k) { return is_failed(k) ? NAN : 0.04 * made_mass(k); }

ordered_json campaign_statistics(const MadeCampaign& made) {
  const auto column = [](const char* name, const char* unit) {
    return ordered_json{{"name", name}, {"unit", unit}, {"description", "what it is"}, {"count", 1}};
  };
  return {
      {"schema", "grapnel-campaign-report/1"},
      {"version", "0.7.0"},
      {"campaign",
       {{"name", made.name},
        {"file", "studies/my target.yaml"},
        {"sha256", made.sha256},
        {"seed", "1"},
        {"total", made.rows}}},
      {"rows", made.rows},
      {"counts", {{"ok", made.rows - made.rows / 50}, {"failed", made.rows / 50}, {"unreachable", 0}, {"success", 1}}},
      {"inputs", {column("targets.target-1.mass", "kg")}},
      {"columns", {column("captured", "1"), column("grasps/tip-1/impulse_magnitude", "N s")}},
      {"worst", {{{"by", "captured"}, {"cases", {{{"index", 42}}, {{"index", made.rows - 1}}}}}}},
      {"reasons", {{{"status", "failed"}, {"examples", {{{"index", 13}}}}}}}};
}

void write_campaign_table(const MadeCampaign& made, const std::filesystem::path& path) {
  const hdf5::Session session;
  std::vector<std::uint64_t> k(made.rows);
  std::vector<std::int32_t> status(made.rows), reason(made.rows);
  std::vector<std::uint8_t> success(made.rows);
  std::vector<double> mass(made.rows), captured(made.rows), impulse(made.rows);
  for (std::uint64_t i = 0; i < made.rows; ++i) {
    k[i] = i;
    status[i] = is_failed(i) ? 1 : 0;
    reason[i] = is_failed(i) ? (i % 100 == 13 ? 1 : 2) : 0;
    success[i] = i % 10 == 3 ? 0 : 1;
    mass[i] = made_mass(i);
    captured[i] = is_failed(i) ? NAN : 1;
    impulse[i] = made_impulse(i);
  }
  if (made.rows > 7) status[7] += made.status_of_row_7, reason[7] += made.reason_of_row_7;
  const Handle file = hdf5::create_in_memory("table");
  write_root(file, made);
  const std::vector<hsize_t> extent{made.rows};
  const auto doubles = [&](const char* name, const std::vector<double>& values, const std::vector<hsize_t>& size) {
    return hdf5::write_dataset(file, name, {H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, size, values.data()});
  };
  hdf5::write_dataset(file, "k", {H5T_STD_U64LE, H5T_NATIVE_UINT64, extent, k.data()});
  const Handle s = hdf5::write_dataset(file, "status", {H5T_STD_I32LE, H5T_NATIVE_INT32, extent, status.data()});
  hdf5::write_attribute(s, "names", std::vector<std::string>{"ok", "failed", "unreachable"});
  hdf5::write_dataset(file, "success", {H5T_STD_U8LE, H5T_NATIVE_UINT8, extent, success.data()});
  hdf5::write_dataset(file, "reason", {H5T_STD_I32LE, H5T_NATIVE_INT32, extent, reason.data()});
  hdf5::write_strings(file, "reasons", {"", "no convergence at t = 3 s", "größer als <erlaubt>"});
  describe(doubles("inputs/targets.target-1.mass", mass, extent), "targets.target-1.mass", "kg", "mass");
  describe(doubles("columns/captured", captured, extent), "captured", "1", "1: yes");
  const std::vector<hsize_t> size{made.short_column ? made.rows - 1 : made.rows};
  describe(doubles("columns/grasps/tip-1/impulse_magnitude", impulse, size), "grasps/tip-1/impulse_magnitude", "N s",
           "how hard");
  put_bytes(path, hdf5::image_of(file));
}

void write_campaign(const MadeCampaign& made, const std::filesystem::path& folder) {
  put_bytes(folder / "campaign.json", campaign_statistics(made).dump());
  write_campaign_table(made, folder / "table.h5");
}

}  // namespace grapnel::test
