//! Service 14, `InterconnectConfig`, and the base's bridges: what is plugged in at the wrist.
//!
//! What the vendor's examples expect to find is plugged in: a wire that leads what the serial port sends back to it,
//! one wire each from pin 1 to pin 3 and from pin 2 to pin 4, and an expander of eight pins, all low, at address 0x20
//! of the I2C bus. The serial port is reached over TCP through a bridge, as in the arm.

use std::collections::BTreeMap;

use crate::kortex::messages::interconnect::{
    BridgeConfig, BridgeIdentifier, BridgePortConfig, BridgeStatus, EthernetConfiguration,
    GpioConfiguration, GpioState, I2cConfiguration, I2cData, I2cReadParameter, I2cWriteParameter,
    UartConfiguration,
};

use super::error::Refused;

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
    pub(super) uart: UartConfiguration,
    pub(super) ethernet: EthernetConfiguration,
    pub(super) i2c: I2cConfiguration,
    pub(super) pins: BTreeMap<i32, (GpioConfiguration, i32)>,
    /// The expander's registers.
    registers: BTreeMap<u32, Vec<u8>>,
    polarity: u8,
    pub(super) bridges: Vec<BridgeConfig>,
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
    pub(super) fn pin(&self, identifier: i32) -> Result<i32, Refused> {
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

    pub(super) fn set_pin(&mut self, asked: &GpioState) -> Result<(), Refused> {
        match self.pins.get_mut(&asked.identifier) {
            Some((config, value)) if config.mode > INPUT => {
                *value = asked.value;
                Ok(())
            }
            _ => Err(Refused::NotAnOutput),
        }
    }

    pub(super) fn configure_pin(&mut self, asked: GpioConfiguration) -> Result<(), Refused> {
        is_pin(asked.identifier)?;
        let value = asked.default_value;
        self.pins.insert(asked.identifier, (asked, value));
        Ok(())
    }

    /// Says whether someone answers on the bus.
    fn bus(&self, address: u32, size: usize) -> Result<(), Refused> {
        if !self.i2c.enabled {
            return Err(Refused::BusOff);
        }
        if address != EXPANDER {
            return Err(Refused::NobodyOnBus);
        }
        if size > LONGEST {
            return Err(Refused::TooManyBytes);
        }
        Ok(())
    }

    pub(super) fn read(
        &self,
        asked: &I2cReadParameter,
        register: bool,
    ) -> Result<I2cData, Refused> {
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

    pub(super) fn write(
        &mut self,
        asked: I2cWriteParameter,
        register: bool,
    ) -> Result<(), Refused> {
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

    pub(super) fn enable(&mut self, asked: &BridgeConfig) -> BridgeStatus {
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

    pub(super) fn disable(&mut self, asked: &BridgeIdentifier) -> BridgeStatus {
        let before = self.bridges.len();
        self.bridges.retain(|bridge| bridge.bridge_id.as_ref() != Some(asked));
        if self.bridges.len() < before { BridgeStatus::Ok } else { BridgeStatus::NotFound }
    }
}

fn is_pin(identifier: i32) -> Result<(), Refused> {
    match identifier {
        1..=4 => Ok(()),
        _ => Err(Refused::NoPin),
    }
}
