// What another host's link sends, or a program of this host asks: whatever it is, what is accepted
// is within bounds, and is written again as the same. Also what becomes of it one after another:
// link_sequences.hpp.
#include <algorithm>

#include "link/core/cards.hpp"
#include "link/core/disagreements.hpp"
#include "link/core/event_header.hpp"
#include "link/core/host_card.hpp"
#include "link/core/pulse.hpp"
#include "link/core/questions.hpp"
#include "link/core/topic_names.hpp"
#include "shm/utf8.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/link_sequences.hpp"
#include "wire/document.hpp"
#include "wire/hosts.hpp"
#include "wire/switch_request.hpp"

namespace arbiter::fuzz {
namespace {

using namespace link;

bool is_beginning(const ByteString& of, Bytes bytes) {
  return of.size() <= bytes.size() && std::equal(of.begin(), of.end(), bytes.begin());
}

void check_event(Bytes bytes) {
  EventHeader header;
  const Bytes beginning(bytes.data(), std::min(bytes.size(), kMaxHeaderBytes));
  if (!read_header(beginning, bytes.size(), header)) return;
  require(header.tokens.size() <= kMaxImporters, "the tokens are bounded");
  require(header_bytes(header) + header.length <= bytes.size(), "the sample is there");
  ByteString written(header_bytes(header));
  write_header(header, WritableBytes(written.data(), written.size()));
  require(is_beginning(written, bytes), "a header is what was written");
}

void check_cards(Bytes bytes) {
  if (const auto card = read_offer_card(bytes)) {
    require(shm::is_host_name(card->host), "a host has a name");
    require(card->source.size() <= shm::kMaxNameLength, "a source's name is bounded");
    require(card->type_revision == 0 || !shm::fault_of(card->type), "a type is a port's");
    require(topic_of_source(card->source).size() < 1024, "a topic's name is bounded");
    require(is_beginning(write_offer_card(*card), bytes), "an offer is what was written");
  }
  if (const auto message = read_token_message(bytes)) {
    require(message->number != 0, "tokens have numbers");
    require(is_beginning(write_token_message(*message), bytes), "a token is what was written");
  }
  if (const auto card = read_demand_card(bytes)) {
    require(card->demand >= Demand::kSamples && card->demand <= Demand::kHeaders,
            "a demand is one of those that there are");
    require(is_beginning(write_demand_card(*card), bytes), "a demand is what was written");
  }
}

void check_hosts(Bytes bytes) {
  if (const auto card = read_host_card(bytes)) {
    require(shm::is_host_name(card->host), "a host has a name");
    require(card->inputs.size() <= kMaxPortsOfCard, "the ports are bounded");
    require(card->inputs.size() <= card->input_count, "none is there that is not counted");
    require(is_beginning(write_host_card(*card), bytes), "a host's card is what was written");
    const PresentHost host{&*card, 0};
    Disagreements disagreements;
    static_cast<void>(disagreements.look({host, host}, 0));
  }
  if (const auto pulse = read_pulse(bytes)) {
    require(is_beginning(write_pulse(*pulse), bytes), "a pulse is what was written");
    RoundTrips trips(1);
    static_cast<void>(trips.next(0));
    trips.note(*pulse, {}, 1000);
    const auto measured = trips.of({});
    require(!measured || (*measured >= 0 && *measured <= 1000), "a round trip is one that can be");
  }
}

void check_questions(Bytes bytes) {
  if (const auto question = read_question(bytes)) {
    require(question->argument.size() <= kMaxArgument, "an argument is bounded");
    require(question->asked.size() <= kMaxAsked, "those who are asked are bounded");
    require(is_beginning(write_question(*question), bytes), "a question is what was written");
  }
  if (const auto answer = read_answer(bytes)) {
    require(is_beginning(write_answer(*answer), bytes), "an answer is what was written");
    OpenQuestions open;
    const std::uint64_t number = open.ask({{7, {}}}, 0);
    const bool is_heard = open.note(*answer, {}, 1);
    require(is_heard == (answer->answerer == 7 && answer->number == number),
            "only who was asked is heard");
  }
}

// What hosts ask each other when they switch, and what they answer.
void check_switch(std::string_view text) {
  if (const auto request = wire::read_switch_request(text)) {
    require(request->attempt != 0, "an attempt has a number");
    require(request->without.size() <= wire::kMaxHostsLeftOut, "hosts left out are bounded");
    const std::string written = wire::write_switch_request(*request);
    require(wire::read_switch_request(written) == request, "a request is read as it is written");
  }
  try {
    const wire::SwitchAnswer answer = wire::read_switch_answer(text);
    static_cast<void>(wire::read_switch_answer(wire::write_switch_answer(answer)));
  } catch (const wire::DocumentError&) {
  }
}

// What programs ask through the local socket.
void check_local_question(std::string_view text) {
  try {
    const wire::LinkQuestion question = wire::read_link_question(text);
    const std::string written = wire::write_link_question(question);
    const wire::LinkQuestion again = wire::read_link_question(written);
    require(again.host == question.host && again.verb == question.verb &&
                again.argument == question.argument,
            "a program's question is read as it is written");
  } catch (const wire::DocumentError&) {
  }
}

}  // namespace
}  // namespace arbiter::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const arbiter::Bytes bytes(reinterpret_cast<const std::byte*>(data), size);
  arbiter::fuzz::check_event(bytes);
  arbiter::fuzz::check_cards(bytes);
  arbiter::fuzz::check_hosts(bytes);
  arbiter::fuzz::check_questions(bytes);
  arbiter::fuzz::check_switch(arbiter::fuzz::text_of(data, size));
  arbiter::fuzz::check_local_question(arbiter::fuzz::text_of(data, size));
  arbiter::fuzz::check_sequences(data, size);
  return 0;
}
