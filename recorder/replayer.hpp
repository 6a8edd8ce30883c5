// Publishes a recording into a running instance: what arrived then arrives again, with what was in
// it, under the same names and types, in the same order and at the same distances.
//
// A component as others are: it has the output ports open that the recording tells of, and the
// instance decides by its own model. Where the policy allows `replay`, each arrival bears the time
// that it should have, whenever the scheduler lets us run (OutputPort::publish_at()).
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "evidence/records.hpp"
#include "recorder/survey.hpp"
#include "recording/mcap.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::recorder {

struct ReplayOptions {
  std::string file;
  NodeOptions node;
  double speed = 1;                  // 2: twice as fast as it was; 0: as fast as possible
  std::vector<std::string> sources;  // patterns; empty: all
  std::vector<std::string> ports;    // patterns of input ports; empty: all
  evidence::TimeSpan part{};         // only what happened then
  std::function<void(const std::string&)> say;
  recording::Watch watch{};  // of the first reading
};

struct Replayed {
  std::uint64_t samples = 0;
  std::uint64_t signals = 0;
  std::uint64_t deactivations = 0;
  std::uint64_t delivered = 0;        // samples, for each input port that got one
  std::uint64_t discarded = 0;        // and for each at which another won
  std::uint64_t refused = 0;          // or that refused it
  std::uint64_t without_payload = 0;  // samples that became signals
  std::uint64_t of_another_type = 0;  // than the source's last sample, and so the port: the same
  std::set<std::string> changed{};    // the sources of these
  std::size_t sources = 0;
  std::uint64_t at_start = 0;  // signals, for who was active as it began
  evidence::Nanoseconds time = 0;
  evidence::Nanoseconds latest = 0;  // how late a call came, at most
  bool was_interrupted = false;
};

// What cannot be published: says which sources, and why.
class ReplayError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Nothing of the recording is at what was chosen.
class NothingChosen : public ReplayError {
 public:
  using ReplayError::ReplayError;
};

class Replayer {
 public:
  // Reads the file once, to know its sources, and opens their ports. Throws ReplayError, Error,
  // McapError, RecordError.
  explicit Replayer(const ReplayOptions& options);

  [[nodiscard]] std::size_t sources() const { return sources_.size(); }
  // Reads the file again. Ends early where `interrupts` is readable.
  Replayed run(const shm::FileDescriptor& interrupts);

 private:
  using Nanoseconds = evidence::Nanoseconds;

  struct Source : SurveyedSource {
    std::optional<OutputPort<void>> port{};
    Nanoseconds deactivated = 0;
    bool has_told = false;  // it has been published
  };
  // Of an activity from before the beginning that lasts for longer than T.
  struct Renewal {
    Nanoseconds time = 0;
    Source* source = nullptr;
  };

  void choose();
  [[nodiscard]] bool is_at_chosen_port(const std::string& source) const;
  using Excepted = std::function<bool(const std::string& source)>;
  void refuse_without_payloads(const Excepted& is_excepted) const;
  void open_port(const std::string& name, Source& source);
  void open_ports();
  void begin(const shm::FileDescriptor& interrupts);
  void signal_active_ones();
  void signal_active(Source& source, Nanoseconds arrived);
  void plan_renewals(Source& source, Nanoseconds last);
  void renew(Nanoseconds recorded, const shm::FileDescriptor& interrupts);
  void deactivate_untold(Nanoseconds recorded, const shm::FileDescriptor& interrupts,
                         Replayed& replayed);
  void await(Nanoseconds recorded, const shm::FileDescriptor& interrupts);
  void publish(const evidence::Record& record, Replayed& replayed);
  void arrive(Source& source, const evidence::Arrival& arrival, Nanoseconds at, Replayed& replayed);
  [[nodiscard]] Nanoseconds due(Nanoseconds recorded) const;

  const ReplayOptions& options_;
  const Survey surveyed_;
  std::map<std::string, Source> sources_;  // those that are chosen
  std::size_t next_untold_ = 0;
  std::vector<Renewal> renewals_;
  std::size_t next_renewal_ = 0;
  std::optional<Node> node_;
  bool keeps_times_ = false;
  bool has_begun_ = false;
  std::uint64_t active_at_start_ = 0;
  Nanoseconds start_ = 0;  // of the replay
  Nanoseconds last_ = 0;   // due time
};

}  // namespace arbiter::recorder
