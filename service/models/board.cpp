#include "service/models/board.hpp"

#include <fcntl.h>

#include <stdexcept>
#include <system_error>

#include "service/kept/handed_back.hpp"
#include "service/kept/step.hpp"
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

Board::Board(PortNames& names, Registry& registry)
    : names_(names),
      registry_(registry),
      writable_(make_board()),
      readable_(shm::reopen(writable_, O_RDONLY)),
      mapping_(writable_, sizeof(shm::Board), shm::Access::kReadWrite),
      writer_(*mapping_.as<shm::Board>()),
      reader_(*mapping_.as<shm::Board>()) {
  shm::TableWriter::initialize(*mapping_.as<shm::Board>());
  names_.use_board(writer_);
}

void Board::inherit(const shm::FileDescriptor& board) {
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
  writer_.renew_pages();  // the last daemon may have died while it changed one
  at_step("board-taken-up");
  names_.use_board(writer_);
}

void Board::reserve(std::size_t words) {
  for (std::size_t slot = 0; slot < shm::kTableSlots; ++slot) {
    const std::size_t offset =
        offsetof(shm::Board, tables) + slot * sizeof(shm::Word) * shm::kMaxTableWords;
    if (const auto error = shm::allocate(writable_, offset, words * sizeof(shm::Word))) {
      throw std::system_error(error, "allocating decision tables");
    }
  }
}

void Board::prepare(const Layout& layout, const std::string& name) {
  const auto& words = layout.words();
  if (const auto error =
          shm::allocate(writable_, writer_.next_offset(), words.size() * sizeof(shm::Word))) {
    throw std::system_error(error, "allocating a decision table");
  }
  const std::uint64_t generation = writer_.next_generation();
  layout.mark_used(generation);
  registry_.name_model(generation, name);
  at_step("model-named");
  writer_.write(words);
  at_step("table-written");
}

void Board::put_in_force() {
  in_force_since_ = shm::monotonic_now();
  writer_.put_in_force();
  at_step("table-in-force");
  names_.set_generation(reader_.generation());
}

std::string Board::name() const {
  const std::uint64_t generation = reader_.generation();
  return generation == 0 ? "" : registry_.model(generation);
}

}  // namespace arbiter::service
