#include "grapnel/result/hdf5_writer.hpp"

#include <optional>
#include <stdexcept>
#include <utility>

#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/file_seal.hpp"
#include "grapnel/result/hdf5_file.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;
using hdf5::describe_dataset;
using hdf5::GrowingDataset;
using hdf5::Handle;
using hdf5::write_attribute;

constexpr const char* kAboutTime = "time of each sample; an impact has two samples at one time, before and after";
constexpr const char* kAboutPhase = "phase of each sample, counted from 0 in the attribute names";

void write_root(const Handle& file, const TimeSeriesMetadata& metadata) {
  const Handle root(H5Gopen2(file.id(), "/", H5P_DEFAULT), H5Gclose, "/");
  write_attribute(root, "schema", kTimeSeriesSchema);
  write_attribute(root, "version", metadata.version);
  write_attribute(root, "scenario", metadata.scenario_name);
  write_attribute(root, "sha256", metadata.scenario_sha256);
}

void describe_series(const Handle& dataset, const Series& s, int order) {
  describe_dataset(dataset, s.unit, s.description);
  write_attribute(dataset, "components", s.components);
  write_attribute(dataset, "order", order);
}

void write_instants(const Handle& file, const TimeSeries& series) {
  const hsize_t samples = series.time.size();
  const Handle time =
      hdf5::write_dataset(file, "time", {H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, {samples}, series.time.data()});
  describe_dataset(time, "s", kAboutTime);
  const Handle phase =
      hdf5::write_dataset(file, "phase", {H5T_STD_I32LE, H5T_NATIVE_INT, {samples}, series.phase.data()});
  describe_dataset(phase, "1", kAboutPhase);
  write_attribute(phase, "names", series.phases);
}

void write_series(const Handle& file, const Series& s, hsize_t samples, int order) {
  std::vector<hsize_t> extent{samples};
  if (s.width() > 1) extent.push_back(s.components.size());
  describe_series(hdf5::write_dataset(file, s.path, {H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, extent, s.data.data()}), s,
                  order);
}

std::string hdf5_image(const TimeSeries& series, const TimeSeriesMetadata& metadata) {
  const hdf5::Session session;
  const Handle file = hdf5::create_in_memory("timeseries");
  write_root(file, metadata);
  write_instants(file, series);
  int order = 0;
  for (const Series& s : series.series) {
    if (s.width() > 0) write_series(file, s, series.time.size(), order);
    ++order;
  }
  return hdf5::image_of(file);
}

[[noreturn]] void cannot_write(const fs::path& path, const std::string& why) {
  throw CannotWrite(why.starts_with("cannot ") ? why : "cannot write " + path.string() + ": " + why);
}

}  // namespace

void write_timeseries_hdf5(const TimeSeries& series, const TimeSeriesMetadata& metadata, const fs::path& path) {
  check_time_series(series);
  std::string image;
  try {
    image = hdf5_image(series, metadata);
    seal(image);
  } catch (const std::exception& e) {
    cannot_write(path, e.what());
  }
  write_file_atomically(path, image);
}

// --- While the samples come -----------------------------------------------------------------------------------------

// HDF5 is held for one block at a time.
class TimeSeriesFile::Growing {
 public:
  Growing(const fs::path& path, const TimeSeriesMetadata& metadata, const TimeSeries& first) : disk_(path) {
    const hdf5::Session session;
    file_.emplace(hdf5::create_on_disk(disk_.temporary()));
    try {
      write_root(*file_, metadata);
      time_.emplace(grow("time", H5T_IEEE_F64LE, 1));
      describe_dataset(time_->handle(), "s", kAboutTime);
      phase_.emplace(grow("phase", H5T_STD_I32LE, 1));
      describe_dataset(phase_->handle(), "1", kAboutPhase);
      int order = 0;
      for (const Series& s : first.series) {
        if (s.width() > 0) {
          series_.push_back(grow(s.path, H5T_IEEE_F64LE, s.components.size()));
          describe_series(series_.back().handle(), s, order);
        }
        ++order;
      }
    } catch (...) {
      close();
      throw;
    }
  }
  ~Growing() {
    const hdf5::Session session;
    close();
  }
  Growing(const Growing&) = delete;
  Growing& operator=(const Growing&) = delete;

  void append(const TimeSeries& block) {
    const hdf5::Session session;
    const hsize_t count = block.time.size();
    time_->append(H5T_NATIVE_DOUBLE, count, block.time.data());
    phase_->append(H5T_NATIVE_INT, count, block.phase.data());
    std::size_t next = 0;
    for (const Series& s : block.series)
      if (s.width() > 0) series_[next++].append(H5T_NATIVE_DOUBLE, count, s.data.data());
  }

  void finish(const std::vector<std::string>& phases) {
    {
      const hdf5::Session session;
      write_attribute(phase_->handle(), "names", phases);
      hdf5::check(H5Fflush(file_->id(), H5F_SCOPE_GLOBAL), "flushing");
      close();
    }
    seal_file(disk_.temporary());
    disk_.commit();
  }

 private:
  // Chunks as in a file that is written in one step.
  GrowingDataset grow(const std::string& path, hid_t type, hsize_t width) const {
    return {*file_,
            "",
            path,
            type,
            {.width = width,
             .chunk_rows = hdf5::rows_of_chunk(width * H5Tget_size(type)),
             .deflate_level = hdf5::kDeflateLevel}};
  }
  void close() {
    series_.clear();
    phase_.reset();
    time_.reset();
    file_.reset();
  }

  AtomicFile disk_;
  std::optional<Handle> file_;
  std::optional<GrowingDataset> time_, phase_;
  std::vector<GrowingDataset> series_;  // without those that have no components
};

TimeSeriesFile::TimeSeriesFile(fs::path path, TimeSeriesMetadata metadata)
    : path_(std::move(path)), metadata_(std::move(metadata)) {}

TimeSeriesFile::~TimeSeriesFile() = default;

void TimeSeriesFile::append(const TimeSeries& block) {
  check_time_series(block);
  if (!file_) file_ = std::make_unique<Growing>(path_, metadata_, block);
  file_->append(block);
}

void TimeSeriesFile::take(TimeSeries& block) {
  try {
    if (fault_.empty()) append(block);
  } catch (const std::exception& e) {
    fault_ = e.what();
    file_.reset();
  }
  samples_ += block.time.size();
  phases_ = block.phases;
  drop_samples(block);
}

void TimeSeriesFile::finish(TimeSeries& last) {
  if (!fault_.empty()) cannot_write(path_, fault_);
  if (!file_) {  // few enough for writing in one step, which takes less space
    if (!last.time.empty()) write_timeseries_hdf5(last, metadata_, path_);
    samples_ += last.time.size();
    return;
  }
  try {
    if (!last.time.empty()) append(last);
    samples_ += last.time.size();
    file_->finish(last.phases.empty() ? phases_ : last.phases);
    file_.reset();
  } catch (const std::exception& e) {
    file_.reset();
    cannot_write(path_, e.what());
  }
}

}  // namespace grapnel
