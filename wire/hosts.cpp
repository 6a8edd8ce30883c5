#include "wire/hosts.hpp"

#include <algorithm>
#include <array>

#include <nlohmann/json.hpp>

#include "wire/document.hpp"
#include "wire/fields.hpp"

namespace arbiter::wire {
namespace {

constexpr std::array<const char*, 4> kKinds{"input port", "source", "host name", "models"};
constexpr std::array<const char*, 4> kOutcomes{"answered", "refused", "silent", "gone"};

struct HostAnswers {
  std::vector<HostAnswer> answers;
};

}  // namespace

void describe(auto& field, Is<HostModel> auto& of) {
  field("generation", of.generation);
  field("name", of.name);
  field("digest", of.digest);
}

void describe(auto& field, Is<HostStatus> auto& of) {
  field("host", of.host);
  field("this", of.is_this);
  field("up", of.is_up);
  field("deaf", of.is_deaf);
  field("since_ns", of.since);
  field("incarnation", of.incarnation);
  field("instance", of.instance);
  field("version", of.version);
  field("daemon", of.has_daemon);
  field("model", of.model);
  field("round_trip_ns", of.round_trip);
  field("imports", of.imports);
  field("input_port_count", of.input_count);
  field("output_port_count", of.output_count);
  field("input_ports", of.inputs);
  field("output_ports", of.outputs);
}

void describe(auto& field, Is<ImportStatus> auto& of) {
  field("source", of.source);
  field("host", of.host);
  field("open", of.is_open);
  field("open_here", of.is_open_here);
  field("hosts", of.hosts);
  field.counter("lost", of.lost);
  field.counter("without_sample", of.without_sample);
  field.counter("late", of.late);
  field.counter("withheld", of.withheld);
}

void describe(auto& field, Is<HostDisagreement> auto& of) {
  field.choice("kind", of.kind, kKinds);
  field("name", of.name);
  field("hosts", of.hosts);
  field("error", of.is_error);
  field("text", of.text);
}

void describe(auto& field, Is<HostsDocument> auto& of) {
  field("host", of.host);
  field("instance", of.instance);
  field("version", of.version);
  field("network", of.network);
  field("waits_for", of.waits_for);
  field("hosts", of.hosts);
  field.counter("without_place", of.without_place);
  field("imports", of.imports);
  field("disagreements", of.disagreements);
}

void describe(auto& field, Is<LinkQuestion> auto& of) {
  field("host", of.host);
  field("verb", of.verb);
  field("argument", of.argument);
}

void describe(auto& field, Is<HostAnswer> auto& of) {
  field("host", of.host);
  field("incarnation", of.incarnation);
  field.choice("outcome", of.outcome, kOutcomes);
  field("took_ns", of.took);
  field("text", of.text);
}

void describe(auto& field, Is<HostAnswers> auto& of) { field("answers", of.answers); }

const HostStatus* HostsDocument::find_host(std::string_view name) const {
  const auto found = std::find_if(hosts.begin(), hosts.end(),
                                  [&](const HostStatus& each) { return each.host == name; });
  return found == hosts.end() ? nullptr : &*found;
}

const HostStatus* HostsDocument::find_this() const {
  const auto found =
      std::find_if(hosts.begin(), hosts.end(), [](const HostStatus& each) { return each.is_this; });
  return found == hosts.end() ? nullptr : &*found;
}

const ImportStatus* HostsDocument::find_import(std::string_view source) const {
  const auto found = std::find_if(imports.begin(), imports.end(),
                                  [&](const ImportStatus& each) { return each.source == source; });
  return found == imports.end() ? nullptr : &*found;
}

std::string without_place_text(std::uint64_t hosts) {
  return "there is no place in the link's list for " + std::to_string(hosts) +
         " of the hosts that were heard, which cannot be asked: give each group of hosts a "
         "--domain of its own";
}

nlohmann::json to_json(const HostsDocument& document) { return FieldWriter::json_of(document); }

HostsDocument read_hosts(std::string_view text) {
  return FieldReader::read_whole<HostsDocument>(text);
}

std::string write_link_question(const LinkQuestion& question) {
  return write_document(FieldWriter::json_of(question));
}

LinkQuestion read_link_question(std::string_view text) {
  return FieldReader::read_whole<LinkQuestion>(text);
}

std::string write_host_answers(const std::vector<HostAnswer>& answers) {
  return write_document(FieldWriter::json_of(HostAnswers{answers}));
}

std::vector<HostAnswer> read_host_answers(std::string_view text) {
  return FieldReader::read_whole<HostAnswers>(text).answers;
}

const char* outcome_name(HostOutcome outcome) noexcept {
  return kOutcomes[static_cast<std::size_t>(outcome)];
}

std::string HostAnswer::why_not() const {
  switch (outcome) {
    case HostOutcome::kRefused:
      return "refuses: " + text;
    case HostOutcome::kSilent:
      return "is silent: its link did not answer within 1 s";
    case HostOutcome::kGone:
      return "is gone: its link has ended, or the network is cut (arbiter hosts says since when)";
    case HostOutcome::kAnswered:
      break;
  }
  return {};
}

}  // namespace arbiter::wire
