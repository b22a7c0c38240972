//! Which calls there are: service and function numbers, with the vendor's names.
//!
//! Numbers from Kinova's `.proto` files of API 2.6; those of 2.3 are the same, and so are the documented
//! ones of 2.8. A function's uid on the wire is `service << 16 | function`.

use std::fmt;

/// One call of one service.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Rpc {
    /// The service's number.
    pub service: u16,
    /// The function's number within it.
    pub function: u16,
    /// `Base.Stop`.
    pub name: &'static str,
}

impl fmt::Display for Rpc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl Rpc {
    /// Returns the call with these numbers, if it is one of [`ALL`].
    pub fn find(service: u16, function: u16) -> Option<Self> {
        ALL.iter().find(|rpc| rpc.service == service && rpc.function == function).copied()
    }
}

/// Returns whether any call of a service is spoken here.
pub fn is_service(number: u16) -> bool {
    ALL.iter().any(|rpc| rpc.service == number)
}

macro_rules! services {
    ($($number:literal $module:ident $service:literal {
        $($call:ident = $function:literal $name:literal,)*
    })*) => {
        $(
            #[doc = concat!("Service ", $number, ", `", $service, "`.")]
            pub mod $module {
                use super::Rpc;
                $(
                    #[doc = concat!("`", $service, ".", $name, "`, function ", $function, ".")]
                    pub const $call: Rpc = Rpc {
                        service: $number,
                        function: $function,
                        name: concat!($service, ".", $name),
                    };
                )*
            }
        )*
        /// Every call spoken here, in order of service and function.
        pub const ALL: &[Rpc] = &[$($($module::$call,)*)*];
    };
}

services! {
    1 session "Session" {
        CREATE_SESSION = 1 "CreateSession",
        CLOSE_SESSION = 2 "CloseSession",
        KEEP_ALIVE = 3 "KeepAlive",
        GET_CONNECTIONS = 4 "GetConnections",
    }
    2 base "Base" {
        CREATE_USER_PROFILE = 1 "CreateUserProfile",
        UPDATE_USER_PROFILE = 2 "UpdateUserProfile",
        READ_USER_PROFILE = 3 "ReadUserProfile",
        DELETE_USER_PROFILE = 4 "DeleteUserProfile",
        READ_ALL_USER_PROFILES = 5 "ReadAllUserProfiles",
        READ_ALL_USERS = 6 "ReadAllUsers",
        CHANGE_PASSWORD = 7 "ChangePassword",
        CREATE_SEQUENCE = 8 "CreateSequence",
        UPDATE_SEQUENCE = 9 "UpdateSequence",
        READ_SEQUENCE = 10 "ReadSequence",
        DELETE_SEQUENCE = 11 "DeleteSequence",
        READ_ALL_SEQUENCES = 12 "ReadAllSequences",
        PLAY_SEQUENCE = 15 "PlaySequence",
        STOP_SEQUENCE = 17 "StopSequence",
        PAUSE_SEQUENCE = 18 "PauseSequence",
        RESUME_SEQUENCE = 19 "ResumeSequence",
        CREATE_PROTECTION_ZONE = 20 "CreateProtectionZone",
        UPDATE_PROTECTION_ZONE = 21 "UpdateProtectionZone",
        READ_PROTECTION_ZONE = 22 "ReadProtectionZone",
        DELETE_PROTECTION_ZONE = 23 "DeleteProtectionZone",
        READ_ALL_PROTECTION_ZONES = 24 "ReadAllProtectionZones",
        CREATE_ACTION = 42 "CreateAction",
        READ_ACTION = 43 "ReadAction",
        READ_ALL_ACTIONS = 44 "ReadAllActions",
        DELETE_ACTION = 45 "DeleteAction",
        UPDATE_ACTION = 46 "UpdateAction",
        EXECUTE_ACTION_FROM_REFERENCE = 47 "ExecuteActionFromReference",
        EXECUTE_ACTION = 48 "ExecuteAction",
        PAUSE_ACTION = 49 "PauseAction",
        STOP_ACTION = 50 "StopAction",
        RESUME_ACTION = 51 "ResumeAction",
        GET_AVAILABLE_WIFI = 63 "GetAvailableWifi",
        UNSUBSCRIBE = 97 "Unsubscribe",
        ON_CONFIGURATION_CHANGE_TOPIC = 98 "OnNotificationConfigurationChangeTopic",
        ON_MAPPING_INFO_TOPIC = 99 "OnNotificationMappingInfoTopic",
        ON_CONTROL_MODE_TOPIC = 100 "OnNotificationControlModeTopic",
        ON_OPERATING_MODE_TOPIC = 101 "OnNotificationOperatingModeTopic",
        ON_SEQUENCE_INFO_TOPIC = 102 "OnNotificationSequenceInfoTopic",
        ON_PROTECTION_ZONE_TOPIC = 103 "OnNotificationProtectionZoneTopic",
        ON_USER_TOPIC = 104 "OnNotificationUserTopic",
        ON_CONTROLLER_TOPIC = 105 "OnNotificationControllerTopic",
        ON_ACTION_TOPIC = 106 "OnNotificationActionTopic",
        ON_ROBOT_EVENT_TOPIC = 107 "OnNotificationRobotEventTopic",
        PLAY_CARTESIAN_TRAJECTORY = 109 "PlayCartesianTrajectory",
        PLAY_CARTESIAN_TRAJECTORY_POSITION = 110 "PlayCartesianTrajectoryPosition",
        PLAY_CARTESIAN_TRAJECTORY_ORIENTATION = 111 "PlayCartesianTrajectoryOrientation",
        STOP = 112 "Stop",
        GET_MEASURED_CARTESIAN_POSE = 115 "GetMeasuredCartesianPose",
        SEND_WRENCH_COMMAND = 118 "SendWrenchCommand",
        SEND_WRENCH_JOYSTICK_COMMAND = 119 "SendWrenchJoystickCommand",
        SEND_TWIST_JOYSTICK_COMMAND = 120 "SendTwistJoystickCommand",
        SEND_TWIST_COMMAND = 121 "SendTwistCommand",
        PLAY_JOINT_TRAJECTORY = 124 "PlayJointTrajectory",
        PLAY_SELECTED_JOINT_TRAJECTORY = 125 "PlaySelectedJointTrajectory",
        GET_MEASURED_JOINT_ANGLES = 126 "GetMeasuredJointAngles",
        SEND_JOINT_SPEEDS_COMMAND = 132 "SendJointSpeedsCommand",
        SEND_SELECTED_JOINT_SPEED_COMMAND = 133 "SendSelectedJointSpeedCommand",
        SEND_GRIPPER_COMMAND = 136 "SendGripperCommand",
        GET_MEASURED_GRIPPER_MOVEMENT = 137 "GetMeasuredGripperMovement",
        SET_ADMITTANCE = 139 "SetAdmittance",
        SET_OPERATING_MODE = 141 "SetOperatingMode",
        APPLY_EMERGENCY_STOP = 145 "ApplyEmergencyStop",
        CLEAR_FAULTS = 146 "ClearFaults",
        GET_CONTROL_MODE = 150 "GetControlMode",
        GET_OPERATING_MODE = 151 "GetOperatingMode",
        SET_SERVOING_MODE = 152 "SetServoingMode",
        GET_SERVOING_MODE = 153 "GetServoingMode",
        ON_SERVOING_MODE_TOPIC = 154 "OnNotificationServoingModeTopic",
        REBOOT = 162 "Reboot",
        ON_FACTORY_TOPIC = 164 "OnNotificationFactoryTopic",
        GET_ALL_CONNECTED_CONTROLLERS = 166 "GetAllConnectedControllers",
        GET_ACTUATOR_COUNT = 171 "GetActuatorCount",
        ON_NETWORK_TOPIC = 174 "OnNotificationNetworkTopic",
        GET_ARM_STATE = 175 "GetArmState",
        ON_ARM_STATE_TOPIC = 176 "OnNotificationArmStateTopic",
        SEND_JOINT_SPEEDS_JOYSTICK_COMMAND = 187 "SendJointSpeedsJoystickCommand",
        SEND_SELECTED_JOINT_SPEED_JOYSTICK_COMMAND = 188 "SendSelectedJointSpeedJoystickCommand",
        ENABLE_BRIDGE = 193 "EnableBridge",
        DISABLE_BRIDGE = 194 "DisableBridge",
        GET_BRIDGE_LIST = 195 "GetBridgeList",
        GET_BRIDGE_CONFIG = 196 "GetBridgeConfig",
        PLAY_PRE_COMPUTED_JOINT_TRAJECTORY = 197 "PlayPreComputedJointTrajectory",
        GET_PRODUCT_CONFIGURATION = 198 "GetProductConfiguration",
        GET_TRAJECTORY_ERROR_REPORT = 207 "GetTrajectoryErrorReport",
        TAKE_SNAPSHOT = 223 "TakeSnapshot",
        GET_FIRMWARE_BUNDLE_VERSIONS = 224 "GetFirmwareBundleVersions",
        EXECUTE_WAYPOINT_TRAJECTORY = 226 "ExecuteWaypointTrajectory",
        COMPUTE_FORWARD_KINEMATICS = 233 "ComputeForwardKinematics",
        COMPUTE_INVERSE_KINEMATICS = 234 "ComputeInverseKinematics",
        VALIDATE_WAYPOINT_LIST = 235 "ValidateWaypointList",
    }
    3 base_cyclic "BaseCyclic" {
        REFRESH = 1 "Refresh",
        REFRESH_COMMAND = 2 "RefreshCommand",
        REFRESH_FEEDBACK = 3 "RefreshFeedback",
        REFRESH_CUSTOM_DATA = 4 "RefreshCustomData",
    }
    5 vision_config "VisionConfig" {
        SET_SENSOR_SETTINGS = 1 "SetSensorSettings",
        GET_SENSOR_SETTINGS = 2 "GetSensorSettings",
        GET_OPTION_VALUE = 3 "GetOptionValue",
        SET_OPTION_VALUE = 4 "SetOptionValue",
        GET_OPTION_INFORMATION = 5 "GetOptionInformation",
        ON_VISION_TOPIC = 6 "OnNotificationVisionTopic",
        DO_SENSOR_FOCUS_ACTION = 7 "DoSensorFocusAction",
        GET_INTRINSIC_PARAMETERS = 8 "GetIntrinsicParameters",
        GET_INTRINSIC_PARAMETERS_PROFILE = 9 "GetIntrinsicParametersProfile",
        SET_INTRINSIC_PARAMETERS = 10 "SetIntrinsicParameters",
        GET_EXTRINSIC_PARAMETERS = 11 "GetExtrinsicParameters",
        SET_EXTRINSIC_PARAMETERS = 12 "SetExtrinsicParameters",
    }
    9 device_config "DeviceConfig" {
        GET_RUN_MODE = 1 "GetRunMode",
        GET_DEVICE_TYPE = 3 "GetDeviceType",
        GET_FIRMWARE_VERSION = 4 "GetFirmwareVersion",
        GET_BOOTLOADER_VERSION = 5 "GetBootloaderVersion",
        GET_MODEL_NUMBER = 6 "GetModelNumber",
        GET_PART_NUMBER = 7 "GetPartNumber",
        GET_SERIAL_NUMBER = 8 "GetSerialNumber",
        GET_MAC_ADDRESS = 9 "GetMACAddress",
        GET_IPV4_SETTINGS = 10 "GetIPv4Settings",
        GET_PART_NUMBER_REVISION = 12 "GetPartNumberRevision",
        REBOOT_REQUEST = 14 "RebootRequest",
        CLEAR_ALL_SAFETY_STATUS = 23 "ClearAllSafetyStatus",
        ON_SAFETY_TOPIC = 28 "OnNotificationSafetyTopic",
    }
    10 actuator_config "ActuatorConfig" {
        GET_CONTROL_MODE = 6 "GetControlMode",
        SET_CONTROL_MODE = 7 "SetControlMode",
        SET_COMMAND_MODE = 24 "SetCommandMode",
        CLEAR_FAULTS = 25 "ClearFaults",
        SET_SERVOING = 26 "SetServoing",
        GET_COMMAND_MODE = 28 "GetCommandMode",
        GET_SERVOING = 29 "GetServoing",
    }
    14 interconnect_config "InterconnectConfig" {
        GET_UART_CONFIGURATION = 1 "GetUARTConfiguration",
        SET_UART_CONFIGURATION = 2 "SetUARTConfiguration",
        GET_ETHERNET_CONFIGURATION = 3 "GetEthernetConfiguration",
        SET_ETHERNET_CONFIGURATION = 4 "SetEthernetConfiguration",
        GET_GPIO_CONFIGURATION = 5 "GetGPIOConfiguration",
        SET_GPIO_CONFIGURATION = 6 "SetGPIOConfiguration",
        GET_GPIO_STATE = 7 "GetGPIOState",
        SET_GPIO_STATE = 8 "SetGPIOState",
        GET_I2C_CONFIGURATION = 9 "GetI2CConfiguration",
        SET_I2C_CONFIGURATION = 10 "SetI2CConfiguration",
        I2C_READ = 11 "I2CRead",
        I2C_READ_REGISTER = 12 "I2CReadRegister",
        I2C_WRITE = 13 "I2CWrite",
        I2C_WRITE_REGISTER = 14 "I2CWriteRegister",
    }
    16 control_config "ControlConfig" {
        SET_GRAVITY_VECTOR = 1 "SetGravityVector",
        GET_GRAVITY_VECTOR = 2 "GetGravityVector",
        SET_PAYLOAD_INFORMATION = 3 "SetPayloadInformation",
        GET_PAYLOAD_INFORMATION = 4 "GetPayloadInformation",
        SET_TOOL_CONFIGURATION = 5 "SetToolConfiguration",
        GET_TOOL_CONFIGURATION = 6 "GetToolConfiguration",
        ON_CONTROL_CONFIGURATION_TOPIC = 7 "OnNotificationControlConfigurationTopic",
        UNSUBSCRIBE = 8 "Unsubscribe",
        SET_CARTESIAN_REFERENCE_FRAME = 9 "SetCartesianReferenceFrame",
        GET_CARTESIAN_REFERENCE_FRAME = 10 "GetCartesianReferenceFrame",
        GET_CONTROL_MODE = 13 "GetControlMode",
        SET_JOINT_SPEED_SOFT_LIMITS = 14 "SetJointSpeedSoftLimits",
        SET_TWIST_LINEAR_SOFT_LIMIT = 15 "SetTwistLinearSoftLimit",
        SET_TWIST_ANGULAR_SOFT_LIMIT = 16 "SetTwistAngularSoftLimit",
        SET_JOINT_ACCELERATION_SOFT_LIMITS = 17 "SetJointAccelerationSoftLimits",
        GET_KINEMATIC_HARD_LIMITS = 18 "GetKinematicHardLimits",
        GET_KINEMATIC_SOFT_LIMITS = 19 "GetKinematicSoftLimits",
        GET_ALL_KINEMATIC_SOFT_LIMITS = 20 "GetAllKinematicSoftLimits",
        SET_DESIRED_LINEAR_TWIST = 21 "SetDesiredLinearTwist",
        SET_DESIRED_ANGULAR_TWIST = 22 "SetDesiredAngularTwist",
        SET_DESIRED_JOINT_SPEEDS = 23 "SetDesiredJointSpeeds",
        GET_DESIRED_SPEEDS = 24 "GetDesiredSpeeds",
        RESET_GRAVITY_VECTOR = 25 "ResetGravityVector",
        RESET_PAYLOAD_INFORMATION = 26 "ResetPayloadInformation",
        RESET_TOOL_CONFIGURATION = 27 "ResetToolConfiguration",
        RESET_JOINT_SPEED_SOFT_LIMITS = 28 "ResetJointSpeedSoftLimits",
        RESET_TWIST_LINEAR_SOFT_LIMIT = 29 "ResetTwistLinearSoftLimit",
        RESET_TWIST_ANGULAR_SOFT_LIMIT = 30 "ResetTwistAngularSoftLimit",
        RESET_JOINT_ACCELERATION_SOFT_LIMITS = 31 "ResetJointAccelerationSoftLimits",
        ON_CONTROL_MODE_TOPIC = 32 "OnNotificationControlModeTopic",
    }
    23 device_manager "DeviceManager" {
        READ_ALL_DEVICES = 1 "ReadAllDevices",
    }
}
