// What another host's link sends: whatever it is, what is accepted is within bounds, and is written
// again as the same.
#include <algorithm>

#include "link/core/cards.hpp"
#include "link/core/event_header.hpp"
#include "link/core/topic_names.hpp"
#include "tests/fuzz/fuzz.hpp"

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
    require(is_host_name(card->host), "a host has a name");
    require(card->source.size() <= shm::kMaxNameLength, "a source's name is bounded");
    require(card->type_revision == 0 || !shm::fault_of(card->type), "a type is a port's");
    require(topic_of_source(card->source).size() < 1024, "a topic's name is bounded");
    require(is_beginning(write_offer_card(*card), bytes), "an offer is what was written");
  }
  if (const auto message = read_token_message(bytes)) {
    require(message->number != 0, "tokens have numbers");
    require(is_beginning(write_token_message(*message), bytes), "a token is what was written");
  }
}

}  // namespace
}  // namespace arbiter::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const arbiter::Bytes bytes(reinterpret_cast<const std::byte*>(data), size);
  arbiter::fuzz::check_event(bytes);
  arbiter::fuzz::check_cards(bytes);
  return 0;
}
