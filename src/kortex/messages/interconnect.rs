//! Service 14, `InterconnectConfig`: what is plugged in at the wrist, and the base's bridges to it.
//!
//! Numbers of enumerations are kept as they come; what they mean stands beside where they are used.

/// `Common.UARTDeviceIdentification`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct UartDeviceIdentification {
    #[prost(uint32, tag = "1")]
    pub port_id: u32,
}

/// `Common.UARTConfiguration`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct UartConfiguration {
    #[prost(uint32, tag = "1")]
    pub port_id: u32,
    #[prost(bool, tag = "2")]
    pub enabled: bool,
    #[prost(int32, tag = "3")]
    pub speed: i32,
    #[prost(int32, tag = "4")]
    pub word_length: i32,
    #[prost(int32, tag = "5")]
    pub stop_bits: i32,
    #[prost(int32, tag = "6")]
    pub parity: i32,
}

/// `EthernetDeviceIdentification` and `I2CDeviceIdentification`, which look the same on the wire.
#[derive(Clone, PartialEq, prost::Message)]
pub struct PortIdentification {
    #[prost(int32, tag = "1")]
    pub device: i32,
}

/// `EthernetConfiguration`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct EthernetConfiguration {
    #[prost(int32, tag = "1")]
    pub device: i32,
    #[prost(bool, tag = "2")]
    pub enabled: bool,
    #[prost(int32, tag = "3")]
    pub speed: i32,
    #[prost(int32, tag = "4")]
    pub duplex: i32,
}

/// `GPIOIdentification`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct GpioIdentification {
    #[prost(int32, tag = "1")]
    pub identifier: i32,
}

/// `GPIOConfiguration`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct GpioConfiguration {
    #[prost(int32, tag = "1")]
    pub identifier: i32,
    #[prost(int32, tag = "2")]
    pub mode: i32,
    #[prost(int32, tag = "3")]
    pub pull: i32,
    #[prost(int32, tag = "4")]
    pub default_value: i32,
}

/// `GPIOState`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct GpioState {
    #[prost(int32, tag = "1")]
    pub identifier: i32,
    #[prost(int32, tag = "2")]
    pub value: i32,
}

/// `I2CConfiguration`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct I2cConfiguration {
    #[prost(int32, tag = "1")]
    pub device: i32,
    #[prost(bool, tag = "2")]
    pub enabled: bool,
    #[prost(int32, tag = "3")]
    pub mode: i32,
    #[prost(int32, tag = "4")]
    pub addressing: i32,
}

/// `I2CReadParameter` and `I2CReadRegisterParameter`: the first leaves the register out.
#[derive(Clone, PartialEq, prost::Message)]
pub struct I2cReadParameter {
    #[prost(int32, tag = "1")]
    pub device: i32,
    #[prost(fixed32, tag = "2")]
    pub device_address: u32,
    #[prost(fixed32, tag = "3")]
    pub register_address: u32,
    #[prost(int32, tag = "4")]
    pub register_address_size: i32,
    #[prost(fixed32, tag = "5")]
    pub size: u32,
    #[prost(fixed32, tag = "6")]
    pub timeout: u32,
}

/// `I2CWriteParameter` and `I2CWriteRegisterParameter`: the first leaves the register out.
#[derive(Clone, PartialEq, prost::Message)]
pub struct I2cWriteParameter {
    #[prost(int32, tag = "1")]
    pub device: i32,
    #[prost(fixed32, tag = "2")]
    pub device_address: u32,
    #[prost(fixed32, tag = "3")]
    pub register_address: u32,
    #[prost(int32, tag = "4")]
    pub register_address_size: i32,
    #[prost(fixed32, tag = "5")]
    pub timeout: u32,
    #[prost(message, optional, tag = "6")]
    pub data: Option<I2cData>,
}

/// `I2CData`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct I2cData {
    #[prost(bytes = "vec", tag = "1")]
    pub data: Vec<u8>,
    #[prost(fixed32, tag = "2")]
    pub size: u32,
}

/// `Base.BridgeIdentifier`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct BridgeIdentifier {
    #[prost(uint32, tag = "1")]
    pub bridge_id: u32,
}

/// `Base.BridgePortConfig`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct BridgePortConfig {
    #[prost(uint32, tag = "1")]
    pub target_port: u32,
    #[prost(uint32, tag = "2")]
    pub out_port: u32,
}

/// `Base.BridgeConfig`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct BridgeConfig {
    #[prost(uint32, tag = "1")]
    pub device_identifier: u32,
    #[prost(int32, tag = "2")]
    pub bridgetype: i32,
    #[prost(message, optional, tag = "3")]
    pub port_config: Option<BridgePortConfig>,
    #[prost(message, optional, tag = "4")]
    pub bridge_id: Option<BridgeIdentifier>,
}

/// `Base.BridgeList`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct BridgeList {
    #[prost(message, repeated, tag = "1")]
    pub bridge_config: Vec<BridgeConfig>,
}

/// `Base.BridgeResult`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct BridgeResult {
    #[prost(message, optional, tag = "1")]
    pub bridge_id: Option<BridgeIdentifier>,
    #[prost(enumeration = "BridgeStatus", tag = "2")]
    pub status: i32,
}

/// `Base.BridgeStatus`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, prost::Enumeration)]
#[repr(i32)]
pub enum BridgeStatus {
    Ok = 0,
    OutputUnavailable = 1,
    UnknownDevice = 2,
    UnknownBridgeType = 3,
    NotFound = 4,
    NotInitialized = 5,
    Unknown = 6,
}
