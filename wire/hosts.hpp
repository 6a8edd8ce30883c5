// The hosts document: what a link knows of its own host and of others. `arbiter hosts` reads it.
//
// docs/hosts.md says what each field means and when it is there; hosts.cpp names them once, for
// both directions. Also the question to a link, and the list of answers that several hosts gave.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "shm/activity.hpp"

namespace arbiter::wire {

struct HostModel {
  std::uint64_t generation = 0;
  std::string name;    // empty: it has none
  std::string digest;  // of its texts: 16 hexadecimal digits; empty: the daemon does not have them
};

struct HostStatus {
  std::string host;
  bool is_this = false;
  bool is_up = true;
  bool is_deaf = false;        // it is up, and has not heard this host for 2 s
  shm::Nanoseconds since = 0;  // CLOCK_MONOTONIC of this machine: up, or gone
  std::string incarnation;     // of its link: 16 hexadecimal digits
  std::string instance;
  std::string version;
  bool has_daemon = false;
  std::optional<HostModel> model;              // none is in force
  std::optional<shm::Nanoseconds> round_trip;  // not measured yet
  std::uint64_t imports = 0;
  std::uint64_t input_count = 0;
  std::uint64_t output_count = 0;
  std::vector<std::string> inputs;  // all, unless they are too many
  std::vector<std::string> outputs;
};

// A source that the model here connects or reads, and that another host has, or had.
struct ImportStatus {
  std::string source;
  std::string host;                // that it is taken from, would be, or was last
  bool is_open = false;            // here, by the link
  bool is_open_here = false;       // by a component of this host, which has precedence
  std::vector<std::string> hosts;  // that offer it
  std::uint64_t lost = 0;
  std::uint64_t without_sample = 0;  // arrivals whose samples could not be sent
  std::uint64_t late = 0;
  std::uint64_t withheld = 0;  // samples that stayed at home

  // It came from `host`, and nobody offers it now.
  [[nodiscard]] bool is_gone() const {
    return !is_open && !is_open_here && hosts.empty() && !host.empty();
  }
};

enum class DisagreementKind : std::uint8_t { kInputPort, kSource, kHostName, kModel };

struct HostDisagreement {
  DisagreementKind kind = DisagreementKind::kInputPort;
  std::optional<std::string> name;
  std::vector<std::string> hosts;
  bool is_error = false;
  std::string text;
};

struct HostsDocument {
  std::string host;
  std::string instance;
  std::string version;
  std::optional<std::string> network;    // the link is not on a network yet
  std::optional<std::string> waits_for;  // why it cannot do its work now
  std::vector<HostStatus> hosts;
  std::uint64_t without_place = 0;  // hosts that are missing there because they are too many
  std::vector<ImportStatus> imports;
  std::vector<HostDisagreement> disagreements;

  // Null: there is none. Of several of that name the first that is up.
  [[nodiscard]] const HostStatus* find_host(std::string_view name) const;
  [[nodiscard]] const HostStatus* find_this() const;
  [[nodiscard]] const ImportStatus* find_import(std::string_view source) const;
};

// As a sentence without its end: so many hosts, which is not 0, are without a place.
[[nodiscard]] std::string without_place_text(std::uint64_t hosts);

[[nodiscard]] nlohmann::json to_json(const HostsDocument& document);
// Throws DocumentError.
[[nodiscard]] HostsDocument read_hosts(std::string_view text);

// Instead of a host's name: all hosts that are there, this one among them.
inline constexpr const char* kAllHosts = "*";

struct LinkQuestion {
  std::string host;  // empty: this link itself
  std::string verb;
  std::string argument{};
};
[[nodiscard]] std::string write_link_question(const LinkQuestion& question);
// Throws DocumentError.
[[nodiscard]] LinkQuestion read_link_question(std::string_view text);

// What became of a question to one host. kGone: it was there some minutes ago.
enum class HostOutcome : std::uint8_t { kAnswered, kRefused, kSilent, kGone };

// As documents say it.
[[nodiscard]] const char* outcome_name(HostOutcome outcome) noexcept;

struct HostAnswer {
  std::string host;
  std::string incarnation;  // of its link
  HostOutcome outcome = HostOutcome::kSilent;
  shm::Nanoseconds took = 0;  // until it answered; 0: it did not
  std::string text;           // the document, or why there is none

  // "did not answer within 1 s", …; of an answer: empty.
  [[nodiscard]] std::string why_not() const;
};
[[nodiscard]] std::string write_host_answers(const std::vector<HostAnswer>& answers);
// Throws DocumentError.
[[nodiscard]] std::vector<HostAnswer> read_host_answers(std::string_view text);

}  // namespace arbiter::wire
