"""Models for files that a program wrote but that may since have been damaged; invalid parts are ignored."""

from typing import Annotated, Any

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    field_validator,
)

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Text = Annotated[str, Field(strict=True)]
Flag = Annotated[bool, Field(strict=True)]
Count = Annotated[int, Field(strict=True, ge=0, lt=2**63)]


class Lenient(BaseModel):
    """Fields keep their defaults if the file has invalid values; fields without a default must be valid.

    Names of invalid fields are appended to the validation context if that is a list. Extra fields are kept as
    they are.
    """

    model_config = ConfigDict(frozen=True, extra="allow", populate_by_name=True)

    @field_validator("*", mode="wrap")
    @classmethod
    def _or_default(cls, value: Any, validate: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
        field = cls.model_fields[str(info.field_name)]
        try:
            return validate(value)
        except ValidationError:
            if field.is_required():
                raise
            if isinstance(info.context, list) and value is not None:  # null means unknown
                info.context.append(field.alias or info.field_name)
            return field.get_default(call_default_factory=True)
