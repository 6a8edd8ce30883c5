// A publisher of iceoryx that writes what it likes into the headers of its chunks, which lie in
// memory that it may write.
//
//   hostile_publisher SERVICE INSTANCE EVENT [HEADER]
//
// Each line of its standard input is a chunk: its payload, a blank, and what is written into its
// header before it is published, such as "x size=4294967295 offset=12". HEADER: bytes of a user
// header, "h" each. Says "ready" when it can publish, and "published" after each line.
#include <unistd.h>

#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <map>
#include <sstream>
#include <string>

#include <iceoryx_posh/mepoo/chunk_header.hpp>
#include <iceoryx_posh/popo/untyped_publisher.hpp>
#include <iceoryx_posh/runtime/posh_runtime.hpp>

namespace {

using iox::mepoo::ChunkHeader;

class Publisher : public iox::popo::UntypedPublisher {
 public:
  using UntypedPublisher::UntypedPublisher;
  // Whatever stands in it.
  void send(ChunkHeader* chunk) { port().sendChunk(chunk); }
};

// As in memory: iceoryx gives nobody else the right to write it.
struct Field {
  std::size_t offset, size;
};
const std::map<std::string, Field> fields{
    {"chunk", {0, 4}}, {"version", {4, 1}},    {"id", {6, 2}},     {"header", {24, 4}},
    {"size", {28, 4}}, {"alignment", {32, 4}}, {"offset", {36, 4}}};
static_assert(sizeof(ChunkHeader) == 40);

iox::capro::IdString_t id(const char* text) {
  return iox::capro::IdString_t(iox::cxx::TruncateToCapacity, text);
}

void write_field(ChunkHeader* chunk, const std::string& text) {
  const auto equals = text.find('=');
  const auto field = fields.find(text.substr(0, equals));
  if (field == fields.end()) std::exit(2);
  const std::uint64_t value = std::strtoull(text.c_str() + equals + 1, nullptr, 10);
  std::memcpy(reinterpret_cast<char*>(chunk) + field->second.offset, &value, field->second.size);
}

void publish(Publisher& publisher, const std::string& line, std::uint32_t header) {
  std::istringstream words(line);
  std::string payload;
  words >> payload;
  auto loan =
      publisher.loan(static_cast<std::uint32_t>(payload.size()), 8, header, header == 0 ? 1 : 4);
  if (loan.has_error()) {
    std::cerr << "no chunk" << std::endl;
    return;
  }
  auto* const chunk = ChunkHeader::fromUserPayload(loan.value());
  if (header != 0) std::memset(chunk->userHeader(), 'h', header);
  std::memcpy(loan.value(), payload.data(), payload.size());
  for (std::string word; words >> word;) write_field(chunk, word);
  publisher.send(chunk);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  const auto header = static_cast<std::uint32_t>(argc > 4 ? std::atoi(argv[4]) : 0);
  const std::string name = "hostile-publisher-" + std::to_string(::getpid());
  iox::runtime::PoshRuntime::initRuntime(
      iox::RuntimeName_t(iox::cxx::TruncateToCapacity, name.c_str()));
  Publisher publisher({id(argv[1]), id(argv[2]), id(argv[3])});
  std::cout << "ready" << std::endl;
  for (std::string line; std::getline(std::cin, line);) {
    publish(publisher, line, header);
    std::cout << "published" << std::endl;
  }
  return 0;
}
