// Rule 9 of docs/hosts.md: what links send, and what they believe of what they get. Headers name 64
// importers at most, and samples have 16 MiB at most (rule 2).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <set>
#include <stdexcept>
#include <string>

#include "link/core/cards.hpp"
#include "link/core/event_header.hpp"
#include "link/core/said_type.hpp"
#include "link/core/topic_names.hpp"
#include "link/core/what_passes.hpp"
#include "shm/utf8.hpp"

namespace arbiter::link {
namespace {

EventHeader some_header() {
  EventHeader header;
  header.kind = EventKind::kSample;
  header.exporter = 0xfedcba9876543210;
  header.number = 7;
  header.sequence = 5;
  header.type_revision = 1;
  header.length = 3;
  header.tokens = {{11, 1}, {22, 2}};
  return header;
}

ByteString written(const EventHeader& header) {
  // As memory is that has been used before.
  ByteString bytes(header_bytes(header), std::byte{0xff});
  write_header(header, WritableBytes(bytes.data(), bytes.size()));
  bytes.resize(bytes.size() + header.length, std::byte{0x55});
  return bytes;
}

static_assert(kMaxImporters == 64, "rule 9 says so");
static_assert(kMaxSampleBytes == std::size_t{16} << 20, "rule 2 says so");
static_assert(kFixedHeaderBytes == 44 && kTokenBytes == 16, "docs/hosts.md says so");

bool reads(const ByteString& bytes) {
  EventHeader header;
  return read_header(Bytes(bytes.data(), bytes.size()), bytes.size(), header);
}

TEST(EventHeader, ComesBackAsItWasWritten) {
  const EventHeader header = some_header();
  ByteString bytes = written(header);
  bytes.push_back(std::byte{0});  // padding
  EventHeader read;
  read.tokens = {{1, 1}};
  ASSERT_TRUE(read_header(Bytes(bytes.data(), bytes.size()), bytes.size(), read));
  EXPECT_EQ(read.kind, header.kind);
  EXPECT_EQ(read.exporter, header.exporter);
  EXPECT_EQ(read.number, header.number);
  EXPECT_EQ(read.sequence, header.sequence);
  EXPECT_EQ(read.type_revision, header.type_revision);
  EXPECT_EQ(read.length, header.length);
  EXPECT_EQ(read.tokens, header.tokens);
  EXPECT_EQ(read.token_of(22), 2U);
  EXPECT_EQ(read.token_of(33), 0U);
}

TEST(EventHeader, IsReadFromTheBeginningOfALargeSample) {
  EventHeader header = some_header();
  header.length = kMaxSampleBytes;
  const std::size_t before = header_bytes(header);
  ByteString bytes(before);
  write_header(header, WritableBytes(bytes.data(), bytes.size()));
  EventHeader read;
  EXPECT_TRUE(read_header(Bytes(bytes.data(), before), before + kMaxSampleBytes, read));
  EXPECT_FALSE(read_header(Bytes(bytes.data(), before), before + kMaxSampleBytes - 1, read))
      << "less than it says has come";
}

TEST(EventHeader, IsNobodysWhereItContradictsItself) {
  EXPECT_TRUE(reads(written(some_header())));
  for (const auto& spoil : std::vector<void (*)(EventHeader&)>{
           [](EventHeader& header) { header.exporter = 0; },
           [](EventHeader& header) { header.number = 0; },
           [](EventHeader& header) { header.type_revision = 0; },
           [](EventHeader& header) { header.is_deactivated = true; },
           [](EventHeader& header) { header.kind = EventKind::kSignal; },
           [](EventHeader& header) { header.kind = EventKind::kDeactivation; },
           [](EventHeader& header) { header.kind = EventKind::kState; },
           [](EventHeader& header) { header.kind = EventKind::kWithheld; },
           [](EventHeader& header) { header.kind = EventKind::kUnsent; },
           [](EventHeader& header) { header.kind = static_cast<EventKind>(0); },
           [](EventHeader& header) { header.kind = static_cast<EventKind>(8); },
       }) {
    EventHeader header = some_header();
    spoil(header);
    EXPECT_FALSE(reads(written(header)));
  }
}

TEST(EventHeader, OfEachKindIsReadWhereItIsConsistent) {
  for (const EventKind kind : {EventKind::kSignal, EventKind::kWithheld, EventKind::kUnsent,
                               EventKind::kDeactivation, EventKind::kState}) {
    EventHeader header = some_header();
    header.kind = kind;
    header.length = 0;
    header.is_deactivated = kind == EventKind::kDeactivation;
    EXPECT_TRUE(reads(written(header))) << static_cast<int>(kind);
  }
}

TEST(EventHeader, IsNobodysWhereItIsCutOrSaysTooMuch) {
  const ByteString whole = written(some_header());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(reads(ByteString(whole.begin(), whole.begin() + static_cast<long>(size))));
  }
  // Magic, version, flags, tokens, reserved.
  for (const std::size_t at : {0U, 3U, 4U, 6U, 7U, 41U, 42U, 43U}) {
    ByteString bytes = whole;
    bytes[at] ^= std::byte{0x80};
    EXPECT_FALSE(reads(bytes)) << at;
  }
}

TEST(EventHeader, WhatANetworkMakesUpIsWithinBounds) {
  std::mt19937 random(5);
  for (int i = 0; i < 20'000; ++i) {
    ByteString bytes = written(some_header());
    for (unsigned n = random() % 4; n > 0; --n) {
      bytes[random() % bytes.size()] = static_cast<std::byte>(random());
    }
    EventHeader header;
    if (!read_header(Bytes(bytes.data(), bytes.size()), bytes.size(), header)) continue;
    EXPECT_LE(header_bytes(header) + header.length, bytes.size());
    EXPECT_LE(header.tokens.size(), kMaxImporters);
  }
}

TEST(Cards, OffersComeBackAsTheyWereWritten) {
  OfferCard card;
  card.incarnation = 3;
  card.host = "base-2.local";
  card.source = "/Nav/cmd:o";
  card.type_revision = 2;
  card.type.set_name("geometry/Twist");
  card.type.size = 48;
  card.type.alignment = 8;
  const ByteString bytes = write_offer_card(card);
  const auto read = read_offer_card(Bytes(bytes.data(), bytes.size()));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->incarnation, 3U);
  EXPECT_EQ(read->host, card.host);
  EXPECT_EQ(read->source, card.source);
  EXPECT_EQ(read->type_revision, 2U);
  EXPECT_EQ(read->type, card.type);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(read_offer_card(Bytes(bytes.data(), size))) << size;
  }
}

TEST(Cards, AnOfferWithoutATypeIsOneWhoseTypeIsNotKnownYet) {
  OfferCard card;
  card.incarnation = 3;
  card.host = "base-2.local";
  card.source = "/Nav/cmd:o";
  const ByteString bytes = write_offer_card(card);
  const auto read = read_offer_card(Bytes(bytes.data(), bytes.size()));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->type_revision, 0U);
}

// Importers drop samples of a revision that no card of theirs has.
TEST(Cards, ATypeThatCannotBeSaidIsTriedAgain) {
  OfferCard card;
  card.type_revision = 1;
  card.type.size = 4;
  const OfferCard before = card;
  shm::TypeInfo type;
  type.set_name("arm/Pose");
  type.size = 8;
  const auto fail = [](const OfferCard&) { throw std::runtime_error("memory is short"); };
  for (int i = 0; i < 2; ++i) {
    EXPECT_THROW(say_type(card, type, fail), std::runtime_error);
    EXPECT_EQ(card.type_revision, 1U);
    EXPECT_EQ(card.type, before.type);
  }
  std::uint32_t said = 0;
  const auto note = [&](const OfferCard& now) { said = now.type_revision; };
  EXPECT_TRUE(say_type(card, type, note));
  EXPECT_EQ(said, 2U) << "no revision is left out";
  EXPECT_EQ(card.type_revision, 2U);
  EXPECT_EQ(card.type, type);
  EXPECT_FALSE(say_type(card, type, fail)) << "it has been said";
}

TEST(Cards, NamesThatWouldMisleadAreNobodys) {
  for (const char* const name : {"", "Nav", "/Nav cmd", "/Nav\n", "/\xff", "/a\"b"}) {
    OfferCard card;
    card.incarnation = 3;
    card.host = "base";
    card.source = name;
    const ByteString bytes = write_offer_card(card);
    EXPECT_FALSE(read_offer_card(Bytes(bytes.data(), bytes.size()))) << name;
  }
  for (const std::string& name :
       {std::string(), std::string("a b"), std::string("\033[2J"), std::string("h\xc3\xa9"),
        std::string(shm::kMaxHostName + 1, 'a')}) {
    OfferCard card;
    card.incarnation = 3;
    card.host = name;
    card.source = "/Nav/cmd:o";
    const ByteString bytes = write_offer_card(card);
    EXPECT_FALSE(read_offer_card(Bytes(bytes.data(), bytes.size()))) << name;
  }
}

TEST(Cards, ATypeThatNoPortCouldHaveIsNobodys) {
  OfferCard card;
  card.incarnation = 3;
  card.host = "base-2.local";
  card.source = "/Nav/cmd:o";
  card.type_revision = 1;
  card.type.set_name("geometry/Twist");
  card.type.size = 48;
  card.type.alignment = 3;
  const ByteString bytes = write_offer_card(card);
  EXPECT_FALSE(read_offer_card(Bytes(bytes.data(), bytes.size())));
}

TEST(Cards, TokensAreNumberedFromOne) {
  const ByteString bytes = write_token_message({9, 4});
  const auto read = read_token_message(Bytes(bytes.data(), bytes.size()));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->importer, 9U);
  EXPECT_EQ(read->number, 4U);
  const ByteString none = write_token_message({9, 0});
  EXPECT_FALSE(read_token_message(Bytes(none.data(), none.size())));
  EXPECT_FALSE(read_token_message(Bytes()));
}

TEST(Cards, ADemandIsOneOfThoseThatThereAre) {
  for (const Demand demand : {Demand::kSamples, Demand::kSmallSamples, Demand::kHeaders}) {
    const ByteString bytes = write_demand_card({7, demand});
    const auto read = read_demand_card(Bytes(bytes.data(), bytes.size()));
    ASSERT_TRUE(read);
    EXPECT_EQ(read->importer, 7U);
    EXPECT_EQ(read->demand, demand);
    EXPECT_FALSE(read_demand_card(Bytes(bytes.data(), bytes.size() - 1)));
  }
  for (const int wrong : {0, 4, 255}) {
    const ByteString bytes = write_demand_card({7, static_cast<Demand>(wrong)});
    EXPECT_FALSE(read_demand_card(Bytes(bytes.data(), bytes.size()))) << wrong;
  }
  const ByteString nobody = write_demand_card({0, Demand::kSamples});
  EXPECT_FALSE(read_demand_card(Bytes(nobody.data(), nobody.size())));
}

TEST(TopicNames, AreDifferentForDifferentSources) {
  EXPECT_EQ(topic_of_source("/Nav/cmd:o"), "arbiter/source/Nav/cmd_3ao");
  std::set<std::string> topics;
  for (const char* const source : {"/a_b", "/a:b", "/a/b", "/a__b", "/a_3ab", "/a.b", "/a-b"}) {
    const std::string topic = topic_of_source(source);
    EXPECT_TRUE(topics.insert(topic).second) << source;
    EXPECT_EQ(topic.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                      "0123456789_/"),
              std::string::npos);
  }
}

TEST(WhatPasses, IsALineHoweverMuchThereIs) {
  EXPECT_EQ(what_passes({}, {"/a:o", "/b:o"}),
            "offers what components of this host will open: nothing yet; imports from other hosts, "
            "unless it is open here: /a:o, /b:o");
  std::vector<std::string> many;
  for (int i = 0; i < 1000; ++i) many.push_back("/" + std::to_string(i));
  EXPECT_EQ(what_passes(many, {}),
            "offers what components of this host have open: /0, /1, /2, /3, /4, /5, /6, /7 and 992 "
            "more; imports nothing: the model in force here reads no source");
}

}  // namespace
}  // namespace arbiter::link
