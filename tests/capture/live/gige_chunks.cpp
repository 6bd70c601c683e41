#include "tests/capture/live/gige_chunks.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace lumigraft::test {
namespace {

// Registers that Aravis's camera does not use.
constexpr guint32 kActive = 0x4000, kEnable = 0x4010;
constexpr guint32 kExposure = 0x0120, kGain = 0x0110;  // the camera's own registers
constexpr guint32 kFrequencyLow = 0x0940;

// By ChunkSelector; the chunk IDs are 0xA1 ... in the same order.
enum Chunk : guint32 { kTime, kExposureTime, kGainOf };
constexpr guint32 kFirstName = 0xA1, kPictureName = 0xA0;

constexpr char kFeatures[] = R"(
  <Boolean Name="ChunkModeActive" NameSpace="Standard">
    <pValue>ChunkModeActiveRegister</pValue><OnValue>1</OnValue><OffValue>0</OffValue>
  </Boolean>
  <IntReg Name="ChunkModeActiveRegister">
    <Address>0x4000</Address><Length>4</Length><AccessMode>RW</AccessMode><pPort>Device</pPort>
    <Sign>Unsigned</Sign><Endianess>BigEndian</Endianess>
  </IntReg>
  <Enumeration Name="ChunkSelector" NameSpace="Standard">
    <EnumEntry Name="Timestamp"><Value>0</Value></EnumEntry>
    <EnumEntry Name="ExposureTime"><Value>1</Value></EnumEntry>
    <EnumEntry Name="Gain"><Value>2</Value></EnumEntry>
    <pValue>ChunkSelectorRegister</pValue>
  </Enumeration>
  <IntReg Name="ChunkSelectorRegister">
    <Address>0x4004</Address><Length>4</Length><AccessMode>RW</AccessMode><pPort>Device</pPort>
    <Sign>Unsigned</Sign><Endianess>BigEndian</Endianess>
  </IntReg>
  <Boolean Name="ChunkEnable" NameSpace="Standard">
    <pValue>ChunkEnableRegister</pValue><OnValue>1</OnValue><OffValue>0</OffValue>
  </Boolean>
  <IntReg Name="ChunkEnableRegister">
    <Address>0x4010</Address><pIndex Offset="4">ChunkSelectorRegister</pIndex><Length>4</Length>
    <AccessMode>RW</AccessMode><pPort>Device</pPort><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess>
  </IntReg>
  <Enumeration Name="BalanceRatioSelector" NameSpace="Standard">
    <EnumEntry Name="Red"><Value>0</Value></EnumEntry>
    <EnumEntry Name="Blue"><Value>1</Value></EnumEntry>
    <pValue>BalanceRatioSelectorRegister</pValue>
  </Enumeration>
  <IntReg Name="BalanceRatioSelectorRegister">
    <Address>0x4020</Address><Length>4</Length><AccessMode>RW</AccessMode><pPort>Device</pPort>
    <Sign>Unsigned</Sign><Endianess>BigEndian</Endianess>
  </IntReg>
  <Float Name="BalanceRatio" NameSpace="Standard"><pValue>BalanceRatioRegister</pValue><Min>0.0</Min><Max>8.0</Max></Float>
  <FloatReg Name="BalanceRatioRegister">
    <Address>0x4030</Address><pIndex Offset="4">BalanceRatioSelectorRegister</pIndex><Length>4</Length>
    <AccessMode>RW</AccessMode><pPort>Device</pPort><Endianess>BigEndian</Endianess>
  </FloatReg>
  <Float Name="Gain" NameSpace="Standard">
    <pValue>GainConverter</pValue><Min>0.0</Min><Max>10.0</Max><Unit>dB</Unit>
  </Float>
  <Converter Name="GainConverter">
    <FormulaTo>FROM</FormulaTo><FormulaFrom>TO</FormulaFrom><pValue>GainRawRegister</pValue>
  </Converter>
  <Port Name="TimestampPort"><ChunkID>A1</ChunkID></Port>
  <Port Name="ExposureTimePort"><ChunkID>A2</ChunkID></Port>
  <Port Name="GainPort"><ChunkID>A3</ChunkID></Port>
  <Integer Name="ChunkTimestamp" NameSpace="Standard"><pValue>ChunkTimestampRegister</pValue></Integer>
  <IntReg Name="ChunkTimestampRegister">
    <Address>0</Address><Length>8</Length><AccessMode>RO</AccessMode><pPort>TimestampPort</pPort>
    <Sign>Unsigned</Sign><Endianess>BigEndian</Endianess>
  </IntReg>
  <Float Name="ChunkExposureTime" NameSpace="Standard"><pValue>ChunkExposureTimeRegister</pValue><Unit>us</Unit></Float>
  <FloatReg Name="ChunkExposureTimeRegister">
    <Address>0</Address><Length>8</Length><AccessMode>RO</AccessMode><pPort>ExposureTimePort</pPort>
    <Endianess>BigEndian</Endianess>
  </FloatReg>
  <Float Name="ChunkGain" NameSpace="Standard"><pValue>ChunkGainRegister</pValue><Unit>dB</Unit></Float>
  <FloatReg Name="ChunkGainRegister">
    <Address>0</Address><Length>4</Length><AccessMode>RO</AccessMode><pPort>GainPort</pPort>
    <Endianess>BigEndian</Endianess>
  </FloatReg>
)";

// GVSP packet: length of the header, and offsets of fields in the packet.
constexpr std::size_t kHeader = 8, kPacketNumber = 5, kPayloadType = 10, kTime_ns = 12;

bool replace(std::string& text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at != std::string::npos) {
    text.replace(at, from.size(), to);
  }
  return at != std::string::npos;
}

std::uint64_t number_at(const std::vector<gchar>& bytes, std::size_t at, std::size_t count) {
  std::uint64_t number = 0;
  for (std::size_t i = at; i < at + count; ++i) {
    number = number << 8 | static_cast<guint8>(bytes[i]);
  }
  return number;
}

void put(std::vector<gchar>& bytes, std::size_t at, std::size_t count, std::uint64_t number) {
  for (std::size_t i = 0; i < count; ++i) {
    bytes[at + i] = static_cast<gchar>(number >> (8 * (count - 1 - i)));
  }
}

void add(std::vector<gchar>& bytes, std::size_t count, std::uint64_t number) {
  bytes.resize(bytes.size() + count);
  put(bytes, bytes.size() - count, count, number);
}

/// ID and length that follow a chunk.
void add_tag(std::vector<gchar>& bytes, guint32 name, std::uint64_t length) {
  add(bytes, 4, name);
  add(bytes, 4, length);
}

guint32 register_at(ArvFakeCamera* camera, guint32 address) {
  guint32 value = 0;
  arv_fake_camera_read_register(camera, address, &value);
  return value;
}

}  // namespace

std::string GigeChunks::described(std::string xml) const {
  std::string features = kFeatures;
  if (kind_ == "chunks-factor") {
    replace(features, "<Max>10.0</Max><Unit>dB</Unit>", "<Max>10.0</Max>");
  }
  if (kind_ == "chunks-automatic") {
    features += R"(
  <Enumeration Name="ExposureAuto" NameSpace="Standard">
    <EnumEntry Name="Continuous"><Value>0</Value></EnumEntry>
    <pValue>BalanceRatioSelectorRegister</pValue>
  </Enumeration>)";
  }
  if (kind_ == "chunks-rolling" || kind_ == "chunks-global") {
    features += R"(
  <Enumeration Name="SensorShutterMode" NameSpace="Standard">
    <EnumEntry Name="Rolling"><Value>0</Value></EnumEntry>
    <EnumEntry Name="Global"><Value>1</Value></EnumEntry>
    <Value>)" + std::string(kind_ == "chunks-global" ? "1" : "0") +
                R"(</Value>
  </Enumeration>
  <Float Name="SensorReadoutTime"><Value>18500.0</Value><Unit>us</Unit></Float>)";
  }
  const bool known = replace(xml, "<pVariable Name=\"WIDTH\">Width</pVariable>",
                             "<pVariable Name=\"WIDTH\">Width</pVariable><pVariable "
                             "Name=\"CHUNKS\">ChunkModeActiveRegister</pVariable>") &&
                     replace(xml, "&amp;0xFF) / 8</Formula>", "&amp;0xFF) / 8 + 64 * CHUNKS</Formula>") &&
                     replace(xml, "</RegisterDescription>", features + "</RegisterDescription>");
  return known ? xml : "";
}

void GigeChunks::set_up(ArvFakeCamera* camera) const {
  if (kind_ == "chunks-ticks") {
    arv_fake_camera_write_register(camera, kFrequencyLow, 125'000'000);
  }
}

GigeChunks::Packets GigeChunks::with_chunks(const Packets& plain, ArvFakeCamera* camera) const {
  constexpr std::size_t kParts = 3;  // leader, data, trailer
  if (plain.size() < kParts || register_at(camera, kActive) == 0) {
    return plain;
  }
  constexpr guint64 kBefore_ns = 7'000'000, kNsPerTick = 8;
  constexpr std::uint64_t kPeriod = 8;
  std::vector<gchar> leader = plain.front(), trailer = plain.back(), payload;
  const std::uint64_t number = number_at(leader, 2, 2);
  const bool faulty = number % kPeriod == kPeriod - 1;
  for (std::size_t i = 1; i + 1 < plain.size(); ++i) {
    payload.insert(payload.end(), plain[i].begin() + kHeader, plain[i].end());
  }
  if (kind_ != "chunks-appended") {
    add_tag(payload, kPictureName, payload.size());
  }
  const std::uint64_t leader_ns = number_at(leader, kTime_ns, 8);
  std::uint64_t time_ns = leader_ns - leader_ns % 1000 - kBefore_ns + 500 + number % 2;
  if (kind_ == "chunks-ticks") {
    put(leader, kTime_ns, 8, leader_ns / kNsPerTick);
    time_ns /= kNsPerTick;
  }
  const auto on = [&](Chunk chunk) { return register_at(camera, kEnable + 4 * chunk) != 0; };
  if (on(kExposureTime)) {
    double exposure_us = register_at(camera, kExposure) * (2.0 + static_cast<double>(number % 2));
    if (faulty && kind_ == "chunks-impossible") exposure_us = std::nan("");
    add(payload, 8, std::bit_cast<std::uint64_t>(exposure_us));
    add_tag(payload, kFirstName + kExposureTime, 8);
  }
  if (on(kGainOf)) {
    add(payload, 4, std::bit_cast<std::uint32_t>(static_cast<float>(register_at(camera, kGain)) + 6.0F));
    add_tag(payload, kFirstName + kGainOf, 4);
  }
  if (on(kTime) && !(faulty && kind_ == "chunks-missing")) {
    const std::uint64_t bytes = faulty && kind_ == "chunks-short" ? 4 : 8;
    add(payload, bytes, time_ns);
    add_tag(payload, kFirstName + kTime, faulty && kind_ == "chunks-torn" ? bytes + 5 : bytes);
  }
  put(leader, kPayloadType, 2,
      kind_ == "chunks-alone" ? ARV_BUFFER_PAYLOAD_TYPE_CHUNK_DATA : 0x4000 | ARV_BUFFER_PAYLOAD_TYPE_IMAGE);
  Packets out = {leader};
  const std::size_t step = plain[1].size() - kHeader;
  for (std::size_t from = 0; from < payload.size(); from += step) {
    std::vector<gchar> packet(plain[1].begin(), plain[1].begin() + kHeader);
    put(packet, kPacketNumber, 3, out.size());
    const auto begin = payload.begin() + static_cast<std::ptrdiff_t>(from);
    packet.insert(packet.end(), begin, begin + static_cast<std::ptrdiff_t>(std::min(step, payload.size() - from)));
    out.push_back(std::move(packet));
  }
  put(trailer, kPacketNumber, 3, out.size());
  out.push_back(std::move(trailer));
  return out;
}

}  // namespace lumigraft::test
