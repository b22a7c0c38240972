//! Service 14, `InterconnectConfig`, and the base's bridges: what is plugged in at the wrist.
//!
//! What the vendor's examples expect to find is plugged in: a wire that leads what the serial port sends back to it,
//! one wire each from pin 1 to pin 3 and from pin 2 to pin 4, and an expander of eight pins, all low, at address 0x20
//! of the I2C bus. The serial port is reached over TCP through a bridge, as in the arm.

use std::collections::BTreeMap;

use crate::execution::kortex::messages::common::DeviceType;
use crate::execution::kortex::messages::interconnect::{
    BridgeConfig, BridgeIdentifier, BridgeList, BridgePortConfig, BridgeResult, BridgeStatus,
    EthernetConfiguration, GpioConfiguration, GpioIdentification, GpioState, I2cConfiguration,
    I2cData, I2cReadParameter, I2cWriteParameter, PortIdentification, UartConfiguration,
    UartDeviceIdentification,
};
use crate::execution::kortex::refusal;
use crate::execution::kortex::rpc::{base, interconnect_config as call};

use super::controller::{Answer, Ask, Controller, No, done, say};

/// `GPIOMode`: an input; the others drive their pin. `GPIOPull` up. `GPIOValue` low and high.
const INPUT: i32 = 1;
const PULL_UP: i32 = 2;
const LOW: i32 = 1;
const HIGH: i32 = 2;
/// `BridgeType.BRIDGE_TYPE_UART`.
const UART: i32 = 1;
/// The port by which the base itself reaches the wrist's serial port; chosen.
const INSIDE: u32 = 5555;
/// Where the expander is on the bus, and its register that turns pins around.
const EXPANDER: u32 = 0x20;
const POLARITY: u8 = 0x10;
/// How much of the bus is read or written at once, bytes.
const LONGEST: usize = 256;
/// How many bridges there may be.
const BRIDGES: usize = 16;

/// What is plugged in at the wrist and how it is set up.
#[derive(Debug, Clone, Default)]
pub(super) struct Expansion {
    uart: UartConfiguration,
    ethernet: EthernetConfiguration,
    i2c: I2cConfiguration,
    pins: BTreeMap<i32, (GpioConfiguration, i32)>,
    /// The expander's registers.
    registers: BTreeMap<u32, Vec<u8>>,
    polarity: u8,
    bridges: Vec<BridgeConfig>,
    next: u32,
    /// The TCP port of the serial port's bridge.
    pub(super) port: u16,
}

impl Expansion {
    /// Returns whether the serial port is on and led through the base.
    pub(super) fn is_bridged(&self) -> bool {
        self.uart.enabled && !self.bridges.is_empty()
    }

    /// Returns what a pin (1 to 4) reads.
    fn pin(&self, identifier: i32) -> Result<i32, No> {
        is_pin(identifier)?;
        let (config, value) = self.pins.get(&identifier).cloned().unwrap_or_default();
        if config.mode > INPUT {
            return Ok(value);
        }
        // The wires lead from pins 1 and 2 to pins 3 and 4.
        let driven = self.pins.get(&(identifier - 2)).filter(|(config, _)| config.mode > INPUT);
        let idle = if config.pull == PULL_UP { HIGH } else { LOW };
        Ok(driven.map_or(idle, |(_, value)| *value))
    }

    fn set_pin(&mut self, asked: &GpioState) -> Result<(), No> {
        match self.pins.get_mut(&asked.identifier) {
            Some((config, value)) if config.mode > INPUT => {
                *value = asked.value;
                Ok(())
            }
            _ => Err(No::device(refusal::INVALID_PARAM, "this pin is not an output")),
        }
    }

    fn configure_pin(&mut self, asked: GpioConfiguration) -> Result<(), No> {
        is_pin(asked.identifier)?;
        let value = asked.default_value;
        self.pins.insert(asked.identifier, (asked, value));
        Ok(())
    }

    /// Says whether someone answers on the bus.
    fn bus(&self, address: u32, size: usize) -> Result<(), No> {
        if !self.i2c.enabled {
            return Err(No::device(refusal::DEVICE_NOT_READY, "the bus is not enabled"));
        }
        if address != EXPANDER {
            return Err(No::device(refusal::METHOD_TIMEOUT, "nobody answers at this address"));
        }
        if size > LONGEST {
            return Err(No::device(refusal::VALUE_IS_ABOVE_MAXIMUM, "at most 256 bytes"));
        }
        Ok(())
    }

    fn read(&self, asked: &I2cReadParameter, register: bool) -> Result<I2cData, No> {
        self.bus(asked.device_address, asked.size as usize)?;
        let mut data = vec![self.polarity; asked.size as usize];
        if register {
            data.fill(0);
            let kept = self.registers.get(&(asked.register_address & 0xFF));
            for (to, from) in data.iter_mut().zip(kept.into_iter().flatten()) {
                *to = *from;
            }
        }
        Ok(I2cData { size: data.len() as u32, data })
    }

    fn write(&mut self, asked: I2cWriteParameter, register: bool) -> Result<(), No> {
        let data = asked.data.unwrap_or_default().data;
        self.bus(asked.device_address, data.len())?;
        if register {
            // A byte's worth of registers, so that nobody fills the memory.
            self.registers.insert(asked.register_address & 0xFF, data);
        } else if let [POLARITY, turned, ..] = data[..] {
            self.polarity = turned;
        }
        Ok(())
    }

    fn enable(&mut self, asked: &BridgeConfig) -> BridgeStatus {
        let out = asked.port_config.as_ref().map_or(0, |ports| ports.out_port);
        if asked.bridgetype != UART {
            return BridgeStatus::UnknownBridgeType;
        }
        if (out != 0 && out != u32::from(self.port)) || self.bridges.len() >= BRIDGES {
            return BridgeStatus::OutputUnavailable;
        }
        self.next += 1;
        let ports = BridgePortConfig { target_port: INSIDE, out_port: u32::from(self.port) };
        self.bridges.push(BridgeConfig {
            port_config: Some(ports),
            bridge_id: Some(BridgeIdentifier { bridge_id: self.next }),
            ..asked.clone()
        });
        BridgeStatus::Ok
    }

    fn disable(&mut self, asked: &BridgeIdentifier) -> BridgeStatus {
        let before = self.bridges.len();
        self.bridges.retain(|bridge| bridge.bridge_id.as_ref() != Some(asked));
        if self.bridges.len() < before { BridgeStatus::Ok } else { BridgeStatus::NotFound }
    }
}

fn is_pin(identifier: i32) -> Result<(), No> {
    match identifier {
        1..=4 => Ok(()),
        _ => Err(No::device(refusal::INVALID_PARAM, "pins are 1 to 4")),
    }
}

impl Controller {
    pub(super) fn interconnect_service(&mut self, ask: &Ask<'_>) -> Answer {
        self.config.must_be(ask.device, DeviceType::Interconnect)?;
        let wrist = &mut self.expansion;
        match ask.rpc {
            call::GET_UART_CONFIGURATION => {
                let asked: UartDeviceIdentification = ask.read()?;
                say(&UartConfiguration { port_id: asked.port_id, ..wrist.uart.clone() })
            }
            call::SET_UART_CONFIGURATION => {
                wrist.uart = ask.read()?;
                done()
            }
            call::GET_ETHERNET_CONFIGURATION => {
                let asked: PortIdentification = ask.read()?;
                say(&EthernetConfiguration { device: asked.device, ..wrist.ethernet.clone() })
            }
            call::SET_ETHERNET_CONFIGURATION => {
                wrist.ethernet = ask.read()?;
                done()
            }
            call::GET_GPIO_CONFIGURATION => {
                let GpioIdentification { identifier } = ask.read()?;
                let kept = wrist.pins.get(&identifier).map(|(config, _)| config.clone());
                say(&GpioConfiguration { identifier, ..kept.unwrap_or_default() })
            }
            call::SET_GPIO_CONFIGURATION => {
                wrist.configure_pin(ask.read()?)?;
                done()
            }
            call::GET_GPIO_STATE => {
                let GpioIdentification { identifier } = ask.read()?;
                say(&GpioState { identifier, value: wrist.pin(identifier)? })
            }
            call::SET_GPIO_STATE => {
                wrist.set_pin(&ask.read()?)?;
                done()
            }
            call::GET_I2C_CONFIGURATION => {
                let asked: PortIdentification = ask.read()?;
                say(&I2cConfiguration { device: asked.device, ..wrist.i2c.clone() })
            }
            call::SET_I2C_CONFIGURATION => {
                wrist.i2c = ask.read()?;
                done()
            }
            call::I2C_READ => say(&wrist.read(&ask.read()?, false)?),
            call::I2C_READ_REGISTER => say(&wrist.read(&ask.read()?, true)?),
            call::I2C_WRITE => {
                wrist.write(ask.read()?, false)?;
                done()
            }
            call::I2C_WRITE_REGISTER => {
                wrist.write(ask.read()?, true)?;
                done()
            }
            _ => Err(No::protocol(refusal::UNSUPPORTED_METHOD, "not emulated")),
        }
    }

    /// The calls about bridges; `None` for any other.
    pub(super) fn bridge_calls(&mut self, ask: &Ask<'_>) -> Option<Answer> {
        let result = |bridge_id, status: BridgeStatus| {
            say(&BridgeResult { bridge_id, status: status as i32 })
        };
        Some(match ask.rpc {
            base::ENABLE_BRIDGE => ask.read().and_then(|asked: BridgeConfig| {
                let device = u8::try_from(asked.device_identifier).unwrap_or(u8::MAX);
                if self.config.must_be(device, DeviceType::Interconnect).is_err() {
                    return result(None, BridgeStatus::UnknownDevice);
                }
                let status = self.expansion.enable(&asked);
                let made = self.expansion.bridges.last().filter(|_| status == BridgeStatus::Ok);
                result(made.and_then(|made| made.bridge_id.clone()), status)
            }),
            base::DISABLE_BRIDGE => ask.read().and_then(|asked: BridgeIdentifier| {
                let status = self.expansion.disable(&asked);
                result(Some(asked), status)
            }),
            base::GET_BRIDGE_LIST => {
                say(&BridgeList { bridge_config: self.expansion.bridges.clone() })
            }
            base::GET_BRIDGE_CONFIG => ask.read().and_then(|asked: BridgeIdentifier| {
                let bridges = &self.expansion.bridges;
                let found = bridges.iter().find(|one| one.bridge_id.as_ref() == Some(&asked));
                let none = || No::device(refusal::ENTITY_NOT_FOUND, "no such bridge");
                say(found.ok_or_else(none)?)
            }),
            _ => return None,
        })
    }
}
