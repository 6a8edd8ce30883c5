#include "service/models.hpp"

#include <fcntl.h>

#include "service/findings.hpp"
#include "service/inheritance.hpp"
#include "shm/clock.hpp"

namespace arbiter::service {
namespace {

shm::FileDescriptor make_board() {
  auto board = shm::make_segment("arbiter-board", sizeof(shm::Board));
  if (const auto error = shm::allocate(board, 0, offsetof(shm::Board, tables))) {
    throw std::system_error(error, "allocating the board");
  }
  shm::seal(board, shm::Seals::kFixedSize);
  return board;
}

}  // namespace

Models::Models(rules::ModelFiles files, Directory& directory)
    : files_(std::move(files)),
      directory_(directory),
      writable_(make_board()),
      readable_(shm::reopen(writable_, O_RDONLY)),
      mapping_(writable_, sizeof(shm::Board), shm::Access::kReadWrite),
      writer_(*mapping_.as<shm::Board>()),
      reader_(*mapping_.as<shm::Board>()) {
  shm::TableWriter::initialize(*mapping_.as<shm::Board>());
}

void Models::inherit(const shm::FileDescriptor& board) {
  auto writable = reopen_inherited(board, sizeof(shm::Board));
  shm::Mapping mapping(writable, sizeof(shm::Board), shm::Access::kReadWrite);
  const auto& header = *mapping.as<shm::Board>();
  if (header.magic != shm::Board::kMagic || header.version != shm::Board::kVersion) {
    throw std::runtime_error("the board is one of another version");
  }
  readable_ = shm::reopen(writable, O_RDONLY);
  writable_ = std::move(writable);
  mapping_ = std::move(mapping);
  writer_ = shm::TableWriter(*mapping_.as<shm::Board>());
  reader_ = shm::TableReader(*mapping_.as<shm::Board>());
}

void Models::read() {
  rules::Diagnostics diagnostics;
  rules::CompiledModel model;
  try {
    const rules::RuleSet rules = rules::load(files_, diagnostics);
    if (!diagnostics.has_errors()) model = rules::compile(rules, diagnostics);
  } catch (const rules::FileError& error) {
    throw BadModel(error.what());
  }
  log_findings(diagnostics);
  if (diagnostics.has_errors()) throw BadModel("the model has errors: " + first_error(diagnostics));
  compiled_ = std::move(model);
}

void Models::prepare() {
  const std::uint64_t generation = writer_.next_generation();
  std::vector<shm::Word> words;
  try {
    words = rules::flatten(compiled_, {[&](const std::string& name) {
                                         Source& source = directory_.source(name);
                                         source.used_by_generation = generation;
                                         return source.id;
                                       },
                                       [&](const std::string& name) {
                                         InputName& input = directory_.input(name);
                                         input.used_by_generation = generation;
                                         return input.id;
                                       }});
  } catch (const std::length_error& error) {
    throw BadModel(error.what());
  }
  if (const auto error =
          shm::allocate(writable_, writer_.next_offset(), words.size() * sizeof(shm::Word))) {
    throw std::system_error(error, "allocating a decision table");
  }
  writer_.write(words);
}

void Models::put_in_force() {
  in_force_since_ = shm::monotonic_now();
  writer_.put_in_force();
  texts_in_force_ = compiled_.texts;
  directory_.set_generation(reader_.generation());
}

}  // namespace arbiter::service
