// A flight recorder's memory: the last minutes, written out when somebody asks.
//
// Its memory is bounded by time and by bytes, whichever comes first; what it writes of its own
// accord, by the number of files, and by a rest after each (kMostRest), at the end of which one
// file has all that has come meanwhile. Such a file is not written at once, for what comes of a
// death is of interest as well (RingOptions::after). What leaves it has been summed up: the state
// of each source, the model, the open ports and the winners at the moment where the rest begins. So
// each file is whole: it begins as any recording does. Large samples do not drive out who
// commanded: beyond half of the memory, payloads give way before records do.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "recorder/own_files.hpp"
#include "recorder/sink.hpp"

namespace arbiter::recorder {

// Why a file is written: somebody asks, or the recorder does it of its own accord.
enum class Cause : std::uint8_t { asked, signal, when, death };
[[nodiscard]] std::string_view name_of(Cause cause);

// A file that has been written, or could not be: then `error` says why.
struct Dumped {
  std::vector<std::uint64_t> requests;  // all that it answers
  std::string file;
  std::string error;
  std::vector<std::string> removed;  // older files, to make room for it
};

struct RingOptions {
  Nanoseconds span = 0;
  std::size_t memory = std::size_t{64} << 20;
  std::string prefix;  // files are called PREFIX-YYYYmmddTHHMMSSZ-CAUSE.mcap
  // How many files are kept of those that it writes of its own accord.
  std::size_t keep = 16;
  recording::McapOptions file;
  evidence::RecordingInfo info;  // but for its wall_offset
  // Asked before each file, for what is in it and for its name: the wall clock may be set
  // meanwhile, as on a robot that has none while it is off.
  std::function<std::int64_t()> wall_offset = evidence::wall_offset_now;
  // Dump where a component has died.
  bool on_death = true;
  // How long a file of its own accord goes on after its reason: never longer than half of the span,
  // nor than what came before it, where the memory keeps less than the span.
  Nanoseconds after = 0;
  // On the pipeline's thread.
  std::function<void(const Dumped&)> told;
};

class Ring : public Sink {
 public:
  explicit Ring(RingOptions options)
      : options_(std::move(options)), own_files_(options_.prefix, options_.keep) {}

  // Any thread: write a file as soon as all that has happened by now is here, some tenths of a
  // second at most; of its own accord, later. Returns the number of the request, which may be that
  // of others for the same cause that wait.
  std::uint64_t request(Cause cause);

  void write(const RecordPtr& record) override;
  void tick(Nanoseconds now, Nanoseconds horizon) override;
  void finish(Nanoseconds horizon) override;

  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  [[nodiscard]] std::uint64_t dumps() const { return dumps_; }

 private:
  void write_due(Nanoseconds now);
  void add(const RecordPtr& record);
  void make_room();
  void forget_oldest();
  void drop_oldest_payload();
  void sum_up(const Record& record);
  void forget_sources();
  struct Request {
    std::uint64_t number = 0;
    Cause cause = Cause::asked;
    Nanoseconds time = 0;
  };
  [[nodiscard]] bool is_due(const Request& request, Nanoseconds now) const;
  [[nodiscard]] bool is_resting(Cause cause, Nanoseconds now) const;
  void dump(Cause cause, std::vector<std::uint64_t> requests);
  [[nodiscard]] std::string write_file(Cause cause) const;
  void write_records(evidence::RecordWriter& writer) const;
  void write_base(evidence::RecordWriter& writer) const;
  [[nodiscard]] std::string give_name(const std::string& written, Cause cause,
                                      std::int64_t wall_offset) const;

  const RingOptions options_;
  OwnFiles own_files_;
  std::map<Cause, Nanoseconds> written_at_;  // the last file that was written of its own accord
  bool is_ending_ = false;
  Nanoseconds horizon_ = 0;  // what happened before is here
  struct Kept {
    RecordPtr record;
    bool lacks_payload = false;  // which had to give way
  };
  std::deque<Kept> records_;
  std::uint64_t forgotten_ = 0;         // how many were before these
  std::deque<std::uint64_t> payloads_;  // numbers of the records that have one, from forgotten_ on
  std::size_t bytes_ = 0;
  std::size_t payload_bytes_ = 0;  // of these
  std::uint64_t dumps_ = 0;

  // What was so at base_time_, where records_ begin.
  Nanoseconds base_time_ = 0;
  std::optional<evidence::Start> start_;
  std::map<std::string, evidence::SourceState> sources_;
  std::map<std::pair<std::string, evidence::Missed::Why>, evidence::Missed> untapped_;
  std::optional<evidence::ModelChange> model_;
  std::map<std::pair<bool, std::string>, evidence::PortChange> ports_;
  std::map<std::string, evidence::WinnerChange> winners_;

  std::mutex mutex_;
  std::vector<Request> requests_;  // under it, by number
  std::uint64_t requested_ = 0;    // under it
};

}  // namespace arbiter::recorder
